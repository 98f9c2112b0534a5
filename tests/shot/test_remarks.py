from pathlib import Path

from pegbar.shot.remarks import Remarks

SHOT = Path("my_shot/shot.toml")


def test_what_is_new_is_told_once_notes_first():
    remarks = Remarks()
    remarks.add(["a note"], ["a warning", "another"], made=True)
    remarks.add(["a note", "b note"], ["a warning"], made=True)
    assert remarks.lines(SHOT) == ["note: a note", "note: b note", "warning: a warning", "warning: another"]
    assert (remarks.notes, remarks.warnings) == (["a note", "b note"], ["a warning", "another"])


def test_of_what_was_told_before_only_the_number_of_warnings_is_said():
    remarks = Remarks()
    remarks.add(["old note"], ["old warning"], made=False)
    remarks.add(["new note"], made=True)
    one = "warning: 1 warning of before still stands: pegbar report my_shot/shot.toml shows it"
    assert remarks.lines(SHOT) == ["note: new note", one]
    remarks.add(warnings=["second"], made=False)
    assert remarks.lines(SHOT)[-1].startswith("warning: 2 warnings of before still stand: ")
    # Kept for reports all the same; and told where a stage finds it anew.
    assert remarks.notes == ["old note", "new note"]
    remarks.add(warnings=["old warning"], made=True)
    assert remarks.lines(SHOT)[1] == "warning: old warning"


def test_nothing_to_say():
    assert Remarks().lines(SHOT) == []
