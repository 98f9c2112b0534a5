"""Wrong usage: one line that names what is missing or wrong, and the help of that very command."""

import pytest

from pegbar.cli.main import COMMANDS, GROUPS, main

#: Arguments, and all that is said, up to the command that shows the help.
SAID = {
    "init": "init: FOLDER is missing: the folder with the drawn frames (see pegbar init --help)",
    "match marks.json": "match: CLIPS is missing: the folder of clips (see pegbar match --help)",
    "animate": "animate: PICTURES is missing: pictures with their joints beside them, or folders of such "
    "(see pegbar animate --help)",
    "animate a.png": "animate: --clip is missing: BVH, AMC or C3D file, or a folder of them; may be repeated "
    "(see pegbar animate --help)",
    "reproduce jain2010-fig9": "reproduce: --data is missing: a folder that holds the experiment's clips somewhere "
    "(see pegbar reproduce --help)",
    "demo d --jobs": "demo: --jobs wants a value: worker processes (default: one a core) (see pegbar demo --help)",
    "check a --frmes 1-2": "check: no option --frmes: did you mean --frames? (see pegbar check --help)",
    "check a --frmes=1-2": "check: no option --frmes: did you mean --frames? (see pegbar check --help)",
    "animate a.png --out b": "animate: no option --out: did you mean --output? (see pegbar animate --help)",
    "align a --frames 1": "align: no option --frames; its options: --overwrite (see pegbar align --help)",
    "animate a.png --nonsense 1": "animate: no option --nonsense (see pegbar animate --help)",
    "align -x": "align: no option -x; its options: --overwrite (see pegbar align --help)",
    "aling a": "no command 'aling': did you mean align? (see pegbar --help)",
    "quux": "no command 'quux' (see pegbar --help)",
    "motion inf": "motion: no command 'inf': did you mean info? (see pegbar motion --help)",
    "motion x": "motion: no command 'x'; there are info, plot (see pegbar motion --help)",
    "align my shot.toml": "align: too much is given: 'shot.toml'; a path with spaces wants quotes "
    "(see pegbar align --help)",
    "demo d --length x": "demo: --length: want a whole number, got 'x' (see pegbar demo --help)",
    "match a b --frame-rate x": "match: --frame-rate: want a number, got 'x' (see pegbar match --help)",
    "secondary a --engine unreal": "secondary: --engine: want pegbar or blender, got 'unreal' "
    "(see pegbar secondary --help)",
    "match a b --write x --write y": "match: --write is given twice (see pegbar match --help)",
}


@pytest.mark.parametrize("given", SAID)
def test_wrong_usage_is_told_in_plain_words(capsys, given):
    assert main(given.split()) == 2
    assert capsys.readouterr().err == f"pegbar: {SAID[given]}\n"


@pytest.mark.parametrize(
    "command",
    [name for name in COMMANDS if name not in (*GROUPS, "composite", "effects")]
    + [f"{group} {name}" for group, names in GROUPS.items() for name in names],
)
def test_every_command_says_which_argument_is_missing(capsys, command):
    assert main(command.split()) == 2
    told = capsys.readouterr().err
    assert f"pegbar: {command}: " in told
    # The name as the help shows it, and what it is.
    assert " is missing: " in told
    assert told.split(" is missing")[0].rsplit(" ", 1)[1].isupper()
    assert told.endswith(f"(see pegbar {command} --help)\n")
