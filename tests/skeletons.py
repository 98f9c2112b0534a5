"""Joint names of well-known skeletons, and small skeletons with positions."""

from __future__ import annotations

import numpy as np

_HIK = (
    "Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg RightFoot RightToeBase Spine {spine} Neck Head "
    "LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand"
)
_HIK_MAP = (
    "Hips {chest} Neck Head LeftArm LeftForeArm LeftHand RightArm RightForeArm RightHand "
    "LeftUpLeg LeftLeg LeftFoot RightUpLeg RightLeg RightFoot"
)


def _both(words: str) -> str:
    """Every word with a * once with l and once with r for it."""
    parts = words.split()
    return " ".join([w.replace("*", "l") for w in parts] + [w.replace("*", "r") for w in parts if "*" in w])


#: Scheme -> (all names, those of pelvis chest neck head, then shoulder elbow hand left and right, hip knee foot left
#: and right), "-" for none.
SCHEMES = {
    "cmu": (
        "Hips LHipJoint LeftUpLeg LeftLeg LeftFoot LeftToeBase RHipJoint RightUpLeg RightLeg RightFoot RightToeBase "
        "LowerBack Spine Spine1 Neck Neck1 Head LeftShoulder LeftArm LeftForeArm LeftHand LeftFingerBase "
        "LeftHandIndex1 LThumb RightShoulder RightArm RightForeArm RightHand RightFingerBase RightHandIndex1 RThumb",
        _HIK_MAP.format(chest="Spine1"),
    ),
    "cmu, 3ds Max naming": (
        "Hips LHipJoint LeftHip LeftKnee LeftAnkle LeftToe RHipJoint RightHip RightKnee RightAnkle RightToe lowerback "
        "Chest Chest2 lowerneck Neck Head LeftCollar LeftShoulder LeftElbow LeftWrist lhand LFingers LThumb "
        "RightCollar RightShoulder RightElbow RightWrist rhand RFingers RThumb",
        "Hips Chest2 lowerneck Head LeftShoulder LeftElbow lhand RightShoulder RightElbow rhand "
        "LeftHip LeftKnee LeftAnkle RightHip RightKnee RightAnkle",
    ),
    "acclaim": (
        _both("root *hipjoint *femur *tibia *foot *toes *clavicle *humerus *radius *wrist *hand *fingers *thumb")
        + " lowerback upperback thorax lowerneck upperneck head head_end",
        "root thorax lowerneck head lhumerus lradius lhand rhumerus rradius rhand "
        "lfemur ltibia lfoot rfemur rtibia rfoot",
    ),
    "humanik": ("Reference " + _HIK.format(spine="Spine1 Spine2 Spine3"), _HIK_MAP.format(chest="Spine3")),
    "mixamo": (
        _HIK.format(spine="Spine1 Spine2") + " HeadTop_End LeftToe_End RightToe_End LeftHandThumb1 LeftHandIndex1",
        _HIK_MAP.format(chest="Spine2"),
    ),
    "accad": ("Hips ToSpine " + _HIK.format(spine="Spine1")[5:], _HIK_MAP.format(chest="Spine1")),
    "accad, joint names": (
        "Hips LeftHip LeftKnee LeftAnkle LeftToe RightHip RightKnee RightAnkle RightToe Chest Chest2 LeftCollar "
        "LeftShoulder LeftElbow LeftWrist RightCollar RightShoulder RightElbow RightWrist Neck Head",
        "Hips Chest2 Neck Head LeftShoulder LeftElbow LeftWrist RightShoulder RightElbow RightWrist "
        "LeftHip LeftKnee LeftAnkle RightHip RightKnee RightAnkle",
    ),
    "fair1": (
        _HIK.format(spine="Spine1 Spine2 Spine3") + " RightHandEnd RightHandThumb1 LeftHandEnd LeftHandThumb1",
        _HIK_MAP.format(chest="Spine3"),
    ),
    "rokoko": (
        "Hips Spine1 Spine2 Spine3 Spine4 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm "
        "RightForeArm RightHand LeftThigh LeftShin LeftFoot LeftToe RightThigh RightShin RightFoot RightToe",
        "Hips Spine4 Neck Head LeftArm LeftForeArm LeftHand RightArm RightForeArm RightHand "
        "LeftThigh LeftShin LeftFoot RightThigh RightShin RightFoot",
    ),
    "makehuman": (
        _both(
            "root pelvis.* upperleg01.* upperleg02.* lowerleg01.* lowerleg02.* foot.* toe1-1.* clavicle.* shoulder01.* "
            "upperarm01.* upperarm02.* lowerarm01.* lowerarm02.* wrist.* finger1-1.* breast.*"
        )
        + " spine05 spine04 spine03 spine02 spine01 neck01 neck02 neck03 head jaw",
        "root spine01 neck01 head upperarm01.l lowerarm01.l wrist.l upperarm01.r lowerarm01.r wrist.r "
        "upperleg01.l lowerleg01.l foot.l upperleg01.r lowerleg01.r foot.r",
    ),
    "unreal": (
        _both(
            "root clavicle_* upperarm_* upperarm_twist_01_* lowerarm_* hand_* index_01_* thigh_* calf_* foot_* ball_*"
        )
        + " pelvis spine_01 spine_02 spine_03 neck_01 head ik_foot_l ik_hand_r",
        "pelvis spine_03 neck_01 head upperarm_l lowerarm_l hand_l upperarm_r lowerarm_r hand_r "
        "thigh_l calf_l foot_l thigh_r calf_r foot_r",
    ),
    "rigify": (
        "spine spine.001 spine.002 spine.003 spine.004 spine.005 spine.006 "
        + _both("shoulder.* upper_arm.* forearm.* hand.* thigh.* shin.* foot.* toe.* heel.02.*"),
        "spine spine.003 spine.004 spine.006 upper_arm.l forearm.l hand.l upper_arm.r forearm.r hand.r "
        "thigh.l shin.l foot.l thigh.r shin.r foot.r",
    ),
    "vrm": (
        "hips spine chest upperChest neck head leftEye leftShoulder leftUpperArm leftLowerArm leftHand rightShoulder "
        "rightUpperArm rightLowerArm rightHand leftUpperLeg leftLowerLeg leftFoot leftToes rightUpperLeg rightLowerLeg "
        "rightFoot rightToes",
        "hips upperChest neck head leftUpperArm leftLowerArm leftHand rightUpperArm rightLowerArm rightHand "
        "leftUpperLeg leftLowerLeg leftFoot rightUpperLeg rightLowerLeg rightFoot",
    ),
    "daz": (
        _both("hip pelvis *ThighBend *ThighTwist *Shin *Foot *Toe *Collar *ShldrBend *ShldrTwist *ForearmBend *Hand")
        + " abdomenLower abdomenUpper chestLower chestUpper neckLower neckUpper head",
        "pelvis chestUpper neckLower head lShldrBend lForearmBend lHand rShldrBend rForearmBend rHand "
        "lThighBend lShin lFoot rThighBend rShin rFoot",
    ),
    "smpl": (
        "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot "
        "right_foot neck left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist "
        "right_wrist left_hand right_hand",
        "pelvis spine3 neck head left_shoulder left_elbow left_hand right_shoulder right_elbow right_hand "
        "left_hip left_knee left_ankle right_hip right_knee right_ankle",
    ),
    "plug-in gait": (
        "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAK LSHO LUPA LELB LFRM LWRA LWRB LFIN RSHO RUPA RELB RFRM RWRA RWRB "
        "RFIN LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI RKNE RTIB RANK RHEE RTOE LFEO CentreOfMass",
        "LPSI STRN C7 LFHD LSHO LELB LFIN RSHO RELB RFIN LASI LKNE LANK RASI RKNE RANK",
    ),
    "cmu markers": (
        "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAC LSHO LUPA LELB LFRM LWRA LWRB LFIN RSHO RUPA RELB RFRM RWRA RWRB "
        "RFIN LFWT RFWT LBWT RBWT LTHI LKNE LSHN LANK LHEE LTOE LMT5 RTHI RKNE RSHN RANK RHEE RTOE RMT5 PEL0 LTI0",
        "LBWT STRN C7 LFHD LSHO LELB LFIN RSHO RELB RFIN LFWT LKNE LANK RFWT RKNE RANK",
    ),
    "animated drawings, characters": (
        "root hip torso neck right_shoulder right_elbow right_hand left_shoulder left_elbow left_hand right_hip "
        "right_knee right_foot left_hip left_knee left_foot",
        "hip torso neck - left_shoulder left_elbow left_hand right_shoulder right_elbow right_hand "
        "left_hip left_knee left_foot right_hip right_knee right_foot",
    ),
}
#: Biped's names have spaces in them.
BIPED = [
    "Bip01",
    *(f"Bip01 {word}" for word in ("Pelvis", "Spine", "Spine1", "Neck", "Head")),
    *(
        f"Bip01 {side} {word}"
        for side in "LR"
        for word in ("Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0")
    ),
]

#: A person 1.7 m tall in a T-pose, Y up, facing +Z: joint -> parent, place.
PERSON = {
    "hips": ("", (0, 0.95, 0)),
    "back": ("hips", (0, 1.1, 0)),
    "chest": ("back", (0, 1.25, 0)),
    "neck": ("chest", (0, 1.42, 0)),
    "head": ("neck", (0, 1.52, 0.02)),
    **{
        side + joint: (parent if parent in ("hips", "chest") else side + parent, (sign * x, y, z))
        for side, sign in (("left ", 1), ("right ", -1))
        for joint, parent, (x, y, z) in (
            ("collar", "chest", (0.03, 1.38, 0)),
            ("shoulder", "collar", (0.18, 1.4, 0)),
            ("elbow", "shoulder", (0.47, 1.4, 0)),
            ("wrist", "elbow", (0.72, 1.4, 0)),
            ("finger", "wrist", (0.9, 1.4, 0)),
            ("hip", "hips", (0.09, 0.9, 0)),
            ("knee", "hip", (0.09, 0.49, 0)),
            ("ankle", "knee", (0.09, 0.08, -0.01)),
            ("toe", "ankle", (0.09, 0.02, 0.15)),
        )
    },
}


def person() -> tuple[list[str], list[int], np.ndarray]:
    """Names, parents and rest positions (J, 3) of a person."""
    names = list(PERSON)
    parents = [names.index(parent) if parent else -1 for parent, _ in PERSON.values()]
    return names, parents, np.array([place for _, place in PERSON.values()], float)
