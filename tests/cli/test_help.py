"""Help is one screen, comes quickly, and names every command."""

import subprocess
import sys
import textwrap
from importlib.metadata import version

import pytest
from rich.console import Console

from pegbar.cli.main import COMMANDS, GROUPS, app, main
from pegbar.cli.overview import SECTIONS, overview

#: Libraries that take long to load, and our own rooms that need them.
HEAVY = {
    *("numpy", "scipy", "cv2", "matplotlib", "rapier3d", "OpenEXR", "pydantic", "yaml", "pygltflib", "xxhash", "av"),
    *("pegbar._kernels", "pegbar.shot", "pegbar.report", "pegbar.scene", "pegbar.arrays"),
}


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"]])
def test_the_overview_fits_on_a_screen(capsys, arguments):
    assert main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 80
    for name, text in COMMANDS.items():
        (line,) = [line for line in lines if f" {name}  " in line]
        assert line.endswith(text.partition("\n")[0])


def test_every_command_has_its_place():
    assert sorted(name for names in SECTIONS.values() for name in names) == sorted(COMMANDS)


def test_a_command_without_a_place_is_shown_all_the_same():
    assert "More        new            What is new." in overview({**COMMANDS, "new": "What is new.\n\nMuch."})


@pytest.fixture
def wide():
    # Not by COLUMNS: every command keeps the console, and its width, of the first time that it printed something.
    app.console = Console(width=2000)
    yield
    app.console = None


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_shows_its_options_and_an_example(capsys, wide, name):
    for command in [[name], *([name, inner] for inner in GROUPS.get(name, ()))]:
        assert main([*command, "--help"]) == 0
        shown = capsys.readouterr().out
        assert f"Usage: pegbar {' '.join(command)}" in shown
        assert (name in GROUPS and len(command) == 1) or f"Example: pegbar {' '.join(command)} " in shown
        # A paragraph is one line, which the terminal wraps.
        text = GROUPS[name][command[1]] if len(command) == 2 else COMMANDS[name]
        assert {" ".join(part.split()) for part in text.split("\n\n")} <= {line.strip() for line in shown.splitlines()}


def test_the_version_is_the_package_s(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == version("pegbar")


def test_help_loads_nothing_heavy():
    # A fresh interpreter; one for all, so that what an earlier command loads would be found as well.
    script = f"""
        import contextlib, io, sys
        from pegbar.cli.main import COMMANDS, GROUPS, main
        inner = [[name, other, "--help"] for name in GROUPS for other in GROUPS[name]]
        wrong = [["nonsense"], ["check"], ["check", "--nonsense"], ["animate", "a.png"]]
        for given in [[], ["--version"], *([name, "--help"] for name in COMMANDS), *inner, *wrong]:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                code = main(given)
            assert code == (2 if given in wrong else 0), (given, code)
            loaded = {HEAVY!r} & set(sys.modules)
            assert not loaded, (given, loaded)
    """
    result = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
