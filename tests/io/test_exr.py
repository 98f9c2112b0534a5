import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import FormatError
from pegbar.io import exr
from pegbar.io.exr import read_exr, read_passes, write_exr

WIDE, HIGH = 7, 5
RAMP = np.arange(WIDE * HIGH, dtype=np.float32).reshape(HIGH, WIDE)
COLOURS = {"R": RAMP, "G": RAMP + 100, "B": RAMP + 200, "A": RAMP + 300}


def save(path, channels, **header):
    """A file by OpenEXR itself."""
    channels = {name: np.ascontiguousarray(array) for name, array in channels.items()}
    with OpenEXR.File(
        {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}, channels
    ) as file:
        file.write(str(path))


def save_parts(path, parts, **headers):
    made = []
    for name, channels in parts.items():
        header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIPS_COMPRESSION, **headers.get(name, {})}
        made.append(OpenEXR.Part(header, channels, name))
    with OpenEXR.File(made) as file:
        file.write(str(path))


def in_layer(layer, channels=COLOURS, dtype=np.float16):
    return {f"{layer}.{name}": array.astype(dtype) for name, array in channels.items()}


@pytest.fixture
def file(tmp_path):
    return tmp_path / "frame.0001.exr"


@pytest.mark.parametrize(
    ("beauty", "others"),
    [
        ("", {}),
        ("", in_layer("beauty", {"R": RAMP, "G": RAMP, "B": RAMP})),
        ("ViewLayer.Combined", in_layer("ViewLayer.Normal", {"X": RAMP, "Y": RAMP, "Z": RAMP})),
        ("beauty", in_layer("diffuse") | in_layer("specular")),
        ("someone's layer", {}),
        ("Combined", in_layer("ViewLayer.Vector", {"X": RAMP, "Y": RAMP, "Z": RAMP, "W": RAMP})),
    ],
)
@pytest.mark.parametrize(
    "depth",
    ["Z", "depth.Z", "ViewLayer.Depth.Z", "Depth.V", "ViewLayer.Depth.V", "depth", "Depth.R", "cam.z", "depth.Y"],
)
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_finds_beauty_and_depth_by_the_names_that_renderers_use(beauty, others, depth, dtype, file):
    colours = in_layer(beauty, dtype=dtype) if beauty else {n: array.astype(dtype) for n, array in COLOURS.items()}
    save(file, {**others, **colours, depth: (RAMP + 7).astype(dtype)})
    passes = read_passes(file)
    assert passes.beauty.dtype == passes.depth.dtype == np.float32
    assert np.array_equal(passes.beauty, np.dstack(list(COLOURS.values())))
    assert np.array_equal(passes.depth, RAMP + 7)


@pytest.mark.parametrize("names", ["part names", "full names"])
def test_reads_several_parts(names, file):
    layer = "ViewLayer.Combined." if names == "full names" else ""
    save_parts(
        file,
        {
            "ViewLayer.Combined": {layer + name: array.astype(np.float16) for name, array in COLOURS.items()},
            "ViewLayer.Depth": {"ViewLayer.Depth.Z" if layer else "Z": RAMP},
            "ViewLayer.Normal": {"X": RAMP, "Y": RAMP, "Z": -RAMP},
        },
    )
    passes = read_passes(file)
    assert np.array_equal(passes.beauty[..., 2], COLOURS["B"])
    assert np.array_equal(passes.depth, RAMP)
    channels = read_exr(file).channels
    assert sorted(channels) == sorted(
        [f"ViewLayer.Combined.{c}" for c in "RGBA"] + ["ViewLayer.Depth.Z"] + [f"ViewLayer.Normal.{c}" for c in "XYZ"]
    )
    assert channels["ViewLayer.Combined.R"].dtype == np.float16
    assert np.array_equal(channels["ViewLayer.Normal.Z"], -RAMP)


def test_reads_tiles(file):
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 4
    save(file, {**COLOURS, "Z": RAMP}, type=OpenEXR.tiledimage, tiles=tiles)
    assert np.array_equal(read_passes(file).depth, RAMP)


def test_without_alpha_it_is_opaque_and_grey_is_spread(file):
    save(file, {name: COLOURS[name] for name in "RGB"})
    assert np.array_equal(read_passes(file, want=["beauty"]).beauty[..., 3], np.ones((HIGH, WIDE)))
    save(file, {"Y": RAMP, "A": RAMP / 99})
    assert np.array_equal(
        read_passes(file, want=["beauty"]).beauty, np.dstack([RAMP, RAMP, RAMP, RAMP / np.float32(99)])
    )
    save(file, {"Y": RAMP})
    assert np.array_equal(read_passes(file, want=["beauty"]).beauty[0, 3], [3, 3, 3, 1])


@pytest.mark.parametrize(("left", "top"), [(0, 0), (2, 1), (-3, -2), (9, 9), (-20, 0), (-2, 3)])
@pytest.mark.parametrize(("width", "height"), [(7, 5), (4, 3), (30, 20)])
@pytest.mark.parametrize("origin", [0, -4])
def test_the_data_window_is_placed_in_the_display_window(left, top, width, height, origin, file):
    windows = {
        "dataWindow": ((left + origin, top + origin), (left + origin + WIDE - 1, top + origin + HIGH - 1)),
        "displayWindow": ((origin, origin), (origin + width - 1, origin + height - 1)),
    }
    save(file, {name: COLOURS[name] for name in "RGB"} | {"Z": RAMP + 1}, **windows)
    passes = read_passes(file)
    depth, alpha = np.full((height, width), np.inf), np.zeros((height, width))
    for row in range(HIGH):
        for column in range(WIDE):
            if 0 <= row + top < height and 0 <= column + left < width:
                depth[row + top, column + left] = RAMP[row, column] + 1
                alpha[row + top, column + left] = 1
    assert np.array_equal(passes.depth, depth)
    assert np.array_equal(passes.beauty[..., 3], alpha)
    assert read_exr(file).size == (width, height)


def test_what_renderers_write_for_nothing_becomes_infinity(file):
    depth = RAMP.copy()
    depth[0, :4] = [1e10, 1e9, np.inf, 9.99e8]
    save(file, {"Z": depth})
    got = read_passes(file, want=["depth"]).depth
    assert got[0, :4].tolist() == [np.inf, np.inf, np.inf, np.float32(9.99e8)]
    assert np.array_equal(got[1:], RAMP[1:])


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_depth_that_is_no_depth_is_named_with_its_pixel(value, file):
    depth = RAMP.copy()
    depth[3, 2] = value
    window = {"dataWindow": ((10, 20), (16, 24)), "displayWindow": ((5, 5), (40, 40))}
    save(file, {"Z": depth}, **window)
    with pytest.raises(FormatError, match=rf"frame\.0001\.exr: depth is {value} at row 18, column 7"):
        read_passes(file, want=["depth"])


def test_a_missing_or_ambiguous_pass_lists_what_there_is(file):
    save(file, in_layer("left") | in_layer("right") | {"left.Z": RAMP, "right.Z": RAMP * 2})
    with pytest.raises(FormatError, match="several beauty passes, name a layer: left, right"):
        read_passes(file)
    with pytest.raises(FormatError, match="several depth passes, name a layer: left, right"):
        read_passes(file, want=["depth"])
    assert np.array_equal(read_passes(file, layer="right").depth, RAMP * 2)
    with pytest.raises(FormatError, match="no beauty pass in layer 'middle'; its channels: left.A, left.B"):
        read_passes(file, layer="middle")
    save(file, {"Z": RAMP, "id": RAMP})
    with pytest.raises(FormatError, match="no beauty pass; its channels: Z, id"):
        read_passes(file)
    save(file, in_layer("Normal", {"X": RAMP, "Y": RAMP, "Z": RAMP}) | COLOURS)
    with pytest.raises(FormatError, match="no depth pass"):
        read_passes(file)
    assert read_passes(file, want=["beauty"]).depth is None
    with pytest.raises(ValueError, match="^want: "):
        read_passes(file, want=["alpha"])


def test_a_layer_without_depth_takes_the_only_depth_there_is(file):
    save(file, in_layer("hoop") | in_layer("ball", dtype=np.float32) | {"Z": RAMP})
    passes = read_passes(file, layer="ball")
    assert np.array_equal(passes.depth, RAMP)
    assert np.array_equal(passes.beauty[..., 0], RAMP)


@pytest.mark.parametrize("kind", ["scanlines", "parts", "tiles"])
def test_cut_anywhere_is_refused_in_silence(kind, file, capfd):
    noise = np.random.default_rng(0).normal(size=(50, 40)).astype(np.float32)
    channels = dict.fromkeys("RGBAZ", noise)
    if kind == "parts":
        save_parts(file, {"rgba": channels, "depth": {"Z": noise}})
    elif kind == "tiles":
        tiles = OpenEXR.TileDescription()
        tiles.xSize = tiles.ySize = 16
        save(file, channels, type=OpenEXR.tiledimage, tiles=tiles)
    else:
        save(file, channels)
    data = file.read_bytes()
    for length in [*range(0, 700, 7), *(len(data) * n // 20 for n in range(20)), len(data) - 1]:
        file.write_bytes(data[:length])
        with pytest.raises(FormatError, match=r"frame\.0001\.exr"):
            read_passes(file)
    assert capfd.readouterr() == ("", "")
    file.write_bytes(data)
    assert np.array_equal(read_passes(file).depth, noise)


def test_random_damage_is_an_error_or_a_picture(file, capfd):
    save(file, {**COLOURS, "Z": RAMP})
    data, random = file.read_bytes(), np.random.default_rng(1)
    read = 0
    for _ in range(300):
        broken = bytearray(data)
        broken[random.integers(len(data))] ^= 1 << random.integers(8)
        file.write_bytes(broken)
        try:
            read += read_passes(file).depth is not None
        except FormatError as error:
            assert "frame.0001.exr" in str(error)  # noqa: PT017
    assert read < 150
    capfd.readouterr()


def test_a_header_longer_than_usual_is_read_whole(file):
    save(file, {**COLOURS, "Z": RAMP}, comment="x" * (1 << 19))
    assert np.array_equal(read_passes(file).depth, RAMP)
    data = file.read_bytes()
    file.write_bytes(data[: 1 << 18])
    with pytest.raises(FormatError, match="cut short"):
        read_passes(file)


def test_an_absurd_size_is_refused_before_memory_is_reserved(file, monkeypatch):
    save(file, {"Z": RAMP})
    data = file.read_bytes()
    window = np.array([0, 0, WIDE - 1, HIGH - 1], "<i4").tobytes()
    assert data.count(window) == 2
    file.write_bytes(data.replace(window, np.array([0, 0, 59999, 59999], "<i4").tobytes()))
    monkeypatch.setattr(OpenEXR, "File", lambda *_, **__: pytest.fail("opened"))
    with pytest.raises(FormatError, match="60000x60000"):
        read_passes(file)


def test_what_cannot_be_opened_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.exr"):
        read_passes(tmp_path / "none.exr")
    with pytest.raises(IsADirectoryError):
        read_passes(tmp_path)


planes = hnp.arrays(np.float32, (3, 4), elements=st.floats(-60000, 60000, width=16))


@given(red=planes, depth=planes, compression=st.sampled_from(["none", "rle", "zips", "zip", "piz"]))
def test_what_is_written_is_read(red, depth, compression, tmp_path_factory):
    file = tmp_path_factory.getbasetemp() / "round ä %d.exr"
    depth[0, 0] = np.inf
    picture = np.dstack([red, red / 2, red / 4, np.abs(red) / 60000])
    write_exr(file, {"": picture, "depth.Z": depth.T.copy().T, "id": red.astype(np.uint32)}, compression=compression)
    got = read_exr(file)
    assert got.size == (4, 3)
    assert {name: array.dtype.name for name, array in got.channels.items()} == {
        **dict.fromkeys("RGBA", "float16"),
        "depth.Z": "float32",
        "id": "uint32",
    }
    assert np.array_equal(got.channels["R"], red)
    assert np.array_equal(got.channels["depth.Z"], depth)
    passes = read_passes(file)
    np.testing.assert_allclose(passes.beauty, picture, rtol=1e-3, atol=1e-7)


def test_colour_beyond_half_is_kept_as_float(file):
    write_exr(file, {"sun.R": RAMP * 1e5, "sun.G": RAMP, "sun.B": RAMP})
    channels = read_exr(file).channels
    assert channels["sun.R"].dtype == np.float32
    assert np.array_equal(channels["sun.R"], RAMP * np.float32(1e5))
    assert channels["sun.G"].dtype == np.float16


@pytest.mark.parametrize(
    ("channels", "options", "problem"),
    [
        ({}, {}, "channels"),
        ({"Z": RAMP[0]}, {}, "channels: 'Z'"),
        ({"": RAMP}, {}, "channels: ''"),
        ({"Z": RAMP, "R": RAMP[:2]}, {}, "channels: want one size"),
        ({"Z": RAMP[:0]}, {}, "channels"),
        ({"Z": RAMP.astype(complex)}, {}, "channels: 'Z'"),
        ({"Z": RAMP}, {"compression": "gzip"}, "compression"),
    ],
)
def test_wrong_channels_are_named(channels, options, problem, file):
    with pytest.raises(ValueError, match=f"^{problem}"):
        write_exr(file, channels, **options)
    assert not file.exists()


def test_a_window_stores_a_part_and_reads_as_the_whole(file):
    chance = np.random.default_rng(2)
    beauty, depth = np.zeros((9, 12, 4), np.float32), np.full((9, 12), np.inf, np.float32)
    beauty[2:6, 3:8], depth[2:6, 3:8] = chance.random((4, 5, 4)), chance.random((4, 5))
    write_exr(file, {"": beauty, "Z": depth}, window=(3, 2, 7, 5))
    read = read_passes(file)
    np.testing.assert_array_equal(read.beauty, beauty.astype(np.float16))
    np.testing.assert_array_equal(read.depth, depth)
    for wrong in ((3, 2, 12, 5), (-1, 0, 3, 3), (4, 4, 3, 5)):
        with pytest.raises(ValueError, match="window: want a part of 12 x 9"):
            write_exr(file, {"": beauty, "Z": depth}, window=wrong)
    with pytest.raises(ValueError, match="channels"):
        write_exr(file, {"": beauty, "Z": depth[:5]}, window=(0, 0, 2, 2))


def test_colour_half_conversion_is_numpys(file):
    values = np.random.default_rng(0).normal(size=(64, 64)).astype(np.float32)
    write_exr(file, {"R": values})
    assert np.array_equal(read_exr(file).channels["R"], values.astype(np.float16))
    assert np.array_equal(exr._to_float(values.astype(np.float16)), values.astype(np.float16).astype(np.float32))
