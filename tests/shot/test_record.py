import json
import os

from pegbar.shot.record import fingerprint, is_up_to_date, record_path, write_record


def made(tmp_path):
    source, output = tmp_path / "in.bin", tmp_path / "out.bin"
    source.write_bytes(b"abc")
    output.write_bytes(b"made")
    write_record([output], "recipe", [fingerprint(source)])
    return source, output


def test_a_new_time_alone_changes_nothing(tmp_path):
    source, output = made(tmp_path)
    assert is_up_to_date([output], "recipe", [source])
    os.utime(source, ns=(1, 1))
    assert is_up_to_date([output], "recipe", [source])


def test_contents_of_the_same_size_are_told_apart(tmp_path):
    source, output = made(tmp_path)
    source.write_bytes(b"abd")
    os.utime(source, ns=(1, 1))
    assert not is_up_to_date([output], "recipe", [source])


def test_what_else_makes_a_frame_out_of_date(tmp_path):
    source, output = made(tmp_path)
    other = tmp_path / "other.bin"
    other.write_bytes(b"abc")
    assert not is_up_to_date([output], "another recipe", [source])
    assert not is_up_to_date([output], "recipe", [source, other])
    assert not is_up_to_date([output], "recipe", [other])
    output.write_bytes(b"mad")
    assert not is_up_to_date([output], "recipe", [source])
    output.unlink()
    assert not is_up_to_date([output], "recipe", [source])


def test_a_damaged_record_is_as_good_as_none(tmp_path):
    source, output = made(tmp_path)
    record = record_path(output)
    whole = record.read_text()
    for text in ("", "{", "[]", json.dumps({"recipe": "recipe"}), whole[:-5], whole.replace("in.bin", "xx.bin")):
        record.write_text(text)
        assert not is_up_to_date([output], "recipe", [source])
    record.write_text(whole)
    assert is_up_to_date([output], "recipe", [source])
