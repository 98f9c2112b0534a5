"""From two dimensions to three: limbs, markers, joint angles, back-projection."""
