"""The shot file's sections as validated values. Unknown keys and wrong values are refused, none is ignored."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "foot": 0.3048}


def parse_color(text: str) -> tuple[int, int, int]:
    """Return the (red, green, blue) of "#rrggbb"; ValueError for anything else."""
    digits = text.removeprefix("#")
    if len(digits) != 6 or not text.startswith("#"):
        raise ValueError(f'want a colour like "#ff8000", got "{text}"')
    try:
        red, green, blue = bytes.fromhex(digits)
    except ValueError:
        raise ValueError(f'want a colour like "#ff8000", got "{text}"') from None
    return red, green, blue


# A colour is a triple, which is never empty.
Color = Annotated[str, AfterValidator(lambda text: parse_color(text) and text.lower())]
Size = tuple[Annotated[int, Field(gt=0, le=65_536)], Annotated[int, Field(gt=0, le=65_536)]]
Coordinate = Annotated[float, Field(allow_inf_nan=False)]
_as_entry = BeforeValidator(lambda value: {"preset": value} if isinstance(value, str) else value)


class Section(BaseModel):
    """What every section has in common: frozen, and no key that pegbar does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_min_length=1)


class ShotSection(Section):
    """``[shot]``: which frames, how fast, how large."""

    name: str | None = None
    frames: str | None = None
    frame_rate: float = Field(default=24.0, gt=0, allow_inf_nan=False)
    size: Size | None = None


class DrawingSection(Section):
    """``[drawing]``: the drawn frames, what is known of their limbs, and how opaque they are."""

    frames: str
    hold: Annotated[int, Field(ge=1)] | list[int] | Literal["sparse"] = 1
    exposure: str | None = None
    level: str | None = None
    camera: Literal["sheet", "drawn"] = "sheet"
    labels: str | None = None
    annotations: str | None = None
    depth: str | None = None
    palette: dict[Color, str] = {}
    tolerance: float = Field(0.0, ge=0, le=442, allow_inf_nan=False)
    background: list[Color] = ["#000000"]
    unknown_colors: Literal["auto", "error", "note"] = "auto"
    reach: float | None = Field(None, ge=0, allow_inf_nan=False)
    half_width: float | None = Field(None, gt=0, allow_inf_nan=False)
    threshold: int = Field(128, ge=0, le=255)
    first_marked: int | None = None
    matte: Literal["auto", "ink", "unmix", "fill", "alpha"] = "auto"
    white_point: int = Field(255, ge=1, le=255)
    interpolation: Literal["linear", "perspective"] = "linear"

    @model_validator(mode="after")
    def _holds_or_has_a_sheet(self) -> DrawingSection:
        if self.exposure is not None and self.hold != 1:
            raise ValueError("hold: the exposure sheet says how long drawings are held; leave one of them out")
        if self.level is not None and self.exposure is None:
            raise ValueError("level: only an exposure sheet has levels")
        return self

    @property
    def refuses_unknown_colors(self) -> bool:
        """Whether a colour that stands for no limb fails its frame: by default where colours are to be exact."""
        return self.unknown_colors == "error" or (self.unknown_colors == "auto" and self.tolerance == 0)


class DotsSection(Section):
    """``[dots]``: a layer of coloured dots that says where the joints are; the annotations are made of it."""

    frames: str
    joints: dict[Color, str] | str
    limbs: dict[str, Color] = {}
    tolerance: float = Field(60.0, ge=0, le=442, allow_inf_nan=False)
    carry: Literal["flow", "straight", "none"] = "flow"
    average: int = Field(1, ge=1)

    @model_validator(mode="after")
    def _averages_about_a_middle(self) -> DotsSection:
        if self.average % 2 == 0:
            raise ValueError(f"average: want an odd number of drawings, got {self.average}")
        return self


class CameraSection(Section):
    """``[camera]``: a still camera, in place of the one in the annotations."""

    matrix: list[Annotated[list[float], Field(min_length=4, max_length=4)]] = Field(min_length=3, max_length=3)


class PassesSection(Section):
    """``[passes]``: what the 3D renderer wrote."""

    beauty: str
    depth: str | None = None
    layer: str | None = None
    unit: Literal["m", "cm", "mm", "inch", "foot"] | Annotated[float, Field(gt=0, allow_inf_nan=False)] = "m"
    camera: Literal["sheet", "drawn"] = "drawn"
    space: Literal["auto", "linear", "display"] = "auto"

    @property
    def metres(self) -> float:
        """Metres per unit of the depth pass."""
        return UNITS[self.unit] if isinstance(self.unit, str) else self.unit


class ClipSection(Section):
    """``[clip]``: the motion clip that the drawing is like, as `pegbar match` finds it, or where to look for one."""

    path: str | None = None
    folder: str | None = None
    start: int = Field(0, ge=0)
    stop: int | None = Field(None, ge=1)
    azimuth: float | None = Field(None, ge=-360, le=360)
    elevation: float | None = Field(None, ge=-90, le=90)
    mirrored: bool = False
    swapped: bool = False
    skeleton: str | None = None
    unit: str | Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    up: Literal["x", "y", "z", "-x", "-y", "-z"] | None = None
    frame_rate: float | None = Field(None, gt=0, allow_inf_nan=False)
    joints: str | None = None

    @model_validator(mode="after")
    def _stops_after_its_start(self) -> ClipSection:
        if self.stop is not None and self.stop <= self.start:
            raise ValueError(f"stop: want a frame after start, got {self.stop} after {self.start}")
        return self

    @model_validator(mode="after")
    def _names_something(self) -> ClipSection:
        if self.path is None and self.folder is None:
            raise ValueError("want a path, or a folder to look in")
        return self


class AlignSection(Section):
    """``[align]``: how the camera is found and the drawing's joints are put into 3D."""

    output: str = "align"
    mode: Literal["auto", "static", "pan", "free"] = "auto"
    root: Literal["auto", "travel", "in_place"] | Annotated[float, Field(ge=0, le=1)] = "auto"
    field_of_view: float | None = Field(default=None, gt=0, lt=180)
    smoothing: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    root_smoothing: float = Field(default=0.25, ge=0, allow_inf_nan=False)
    level: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    proportions: Literal["auto", "drawn", "clip"] = "auto"
    ground: bool = False
    floor: float | None = Field(default=None, allow_inf_nan=False)
    use: Literal["auto", "always", "never"] = "auto"


class FlipEntry(Section):
    """A limb whose depth is turned the other way by hand: the joint at its outer end, and for which drawings."""

    joint: str
    drawings: str


class HeldEntry(Section):
    """A joint that stays at one place for a range of drawings: where it is in their mean, or ``at`` world metres."""

    joint: str
    drawings: str
    at: tuple[Coordinate, Coordinate, Coordinate] | None = None


class LiftSection(Section):
    """``[lift]``: how the drawing becomes a 3D animation, and what is written."""

    output: str = "lift"
    depth: Literal["clip", "lengths"] = "clip"
    stretch: bool = False
    lengths: Literal["found", "clip"] | dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]] = "found"
    planted: bool | dict[Literal["left_foot", "right_foot"], str] = True
    held: list[HeldEntry] = []
    flips: list[FlipEntry] = []
    skeleton: str | None = None
    skeleton_joints: str | None = None
    skeleton_size: Literal["own", "drawing"] = "own"
    proportions: Literal["drawing", "skeleton"] | None = None
    frame_rate: Literal["drawings"] | Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    interpolation: Literal["step", "linear"] = "step"
    loop: bool = False
    formats: list[Literal["bvh", "glb", "usd", "csv", "npz"]] = ["bvh", "glb", "csv", "npz"]
    preview: Literal["gif", "png", "webp", "none"] = "gif"

    @model_validator(mode="after")
    def _lengths_need_their_depth(self) -> LiftSection:
        if self.lengths != "found" and self.depth != "lengths":
            raise ValueError('lengths: only depth = "lengths" takes lengths of limbs')
        return self


class WindSection(Section):
    """``[secondary.wind]``: steady air and gusts."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = Field(default=0.5, ge=0, allow_inf_nan=False)
    size: float = Field(default=1.5, gt=0, allow_inf_nan=False)


class ElementEntry(BaseModel):
    """One entry of ``elements``: a preset and what is to be different from it; the preset checks its own keys."""

    model_config = ConfigDict(extra="allow", frozen=True, str_min_length=1)

    preset: str
    name: str | None = None
    character: str | None = None

    @property
    def fields(self) -> dict[str, Any]:
        """The preset's own keys."""
        return dict(self.model_extra or {})


class SecondarySection(Section):
    """``[secondary]``: what is simulated around the drawn character, and how it is rendered."""

    output: str = "secondary"
    elements: list[Annotated[ElementEntry, _as_entry]] = Field(default=[], min_length=1)
    ground: Literal["auto", "none"] | Annotated[float, Field(allow_inf_nan=False)] = "auto"
    gravity: float = Field(default=9.81, ge=0, allow_inf_nan=False)
    wind: WindSection = WindSection()
    pre_roll: int = Field(default=24, ge=0, le=10_000)
    seed: int = Field(default=0, ge=0)
    engine: Literal["pegbar", "blender"] = "pegbar"
    renderer: Literal["pegbar", "blender"] = "pegbar"
    blender: str | None = None
    samples: int = Field(default=2, ge=1, le=8)
    shadow: bool = True
    passes: bool = True
    separate: bool = True
    clearance: float = Field(default=0.03, ge=0, le=1)
    misfit: float = Field(default=0.25, gt=0, allow_inf_nan=False)
    characters: list[str] = []
    frames: str = "secondary/final/final.####.png"


class OutputSection(Section):
    """``[output]``: what is written, as patterns with a frame number."""

    frames: str = "final/final.####.png"
    depth: str = "depth/depth.####.exr"
    depth_picture: str | None = "depth/depth.####.png"
    holdout: str | None = None
    visible: str | None = None
    layers: str | None = None
    space: Literal["auto", "display", "linear"] = "auto"
    size: Size | None = None

    @model_validator(mode="after")
    def _linear_needs_floats(self) -> OutputSection:
        if self.space == "linear" and not self.is_exr:
            raise ValueError('space = "linear" writes linear light, which only .exr frames hold')
        return self

    @property
    def is_exr(self) -> bool:
        """Whether the final frames are EXR files."""
        return self.frames.lower().endswith(".exr")

    @property
    def composite_space(self) -> Literal["display", "linear"]:
        """The space that the final frames are composited and written in: EXR files hold linear light."""
        if self.space == "auto":
            return "linear" if self.is_exr else "display"
        return self.space


class ShotFile(Section):
    """A whole shot file. Later steps add sections."""

    shot: ShotSection = Field(default_factory=ShotSection)
    drawing: DrawingSection
    dots: DotsSection | None = None
    clip: ClipSection | None = None
    align: AlignSection = AlignSection()
    lift: LiftSection = LiftSection()
    secondary: SecondarySection | None = None
    camera: CameraSection | None = None
    passes: PassesSection | None = None
    output: OutputSection = Field(default_factory=OutputSection)
