"""What the guide, the README and the commands' help show is run: commands, Python and shot files."""

import shlex
import shutil

import pytest

from pegbar.cli.main import COMMANDS, GROUPS, main
from tests.guide import PAGES, REASONS, blocks, call, commands, make_workshop, run

#: So many blocks may stay unrun.
MOST_UNRUN = 10
EXAMPLES = [
    example
    for name, text in COMMANDS.items()
    for help_text in (GROUPS[name].values() if name in GROUPS else [text])
    for example in [part.replace("\n", " ").removeprefix("Example: ") for part in help_text.split("\n\n")]
    if example.startswith("pegbar ")
]
ALL = [block for page in PAGES for block in blocks(page)]
RUN = [page for page in PAGES if any(block.reason is None for block in blocks(page))]


@pytest.fixture(scope="module")
def workshop(tmp_path_factory, test_data):
    """A folder with a finished demo and everything else that commands in the guide name."""
    folder = tmp_path_factory.mktemp("guide")
    assert main(["demo", str(folder / "demo"), "--length", "12"]) == 0
    make_workshop(folder, test_data)
    return folder


@pytest.fixture
def here(workshop, monkeypatch):
    """The workshop as the working directory, shot file and marks as at first; nothing else that others read changes."""
    shutil.copy(workshop / "shot.toml", workshop / "my_shot")
    shutil.copy(workshop / "a.json", workshop / "my_shot/annotation.json")
    monkeypatch.chdir(workshop)
    return workshop


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.name)
def test_what_a_page_shows_runs(page, here):
    wanted = [block for block in blocks(page) if block.reason is None]
    assert [run(block, here) for block in wanted] == [True] * len(wanted)


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_examples_of_the_help_run_on_the_demo(example, here):
    (command,) = commands(example, here)
    if command == ["pegbar", "demo", "demo"]:
        # The workshop's own demo was made so, only shorter.
        assert (here / "demo/index.html").exists()
        return
    assert call(command) == 0, shlex.join(command)


def test_every_command_has_an_example():
    named = {
        tuple(example.split()[1:3]) if example.split()[1] in GROUPS else example.split()[1] for example in EXAMPLES
    }
    inner = {(name, other) for name in GROUPS for other in GROUPS[name]}
    assert named == (set(COMMANDS) - set(GROUPS)) | inner


def test_few_blocks_are_left_out_and_for_a_reason():
    left_out = [block for block in ALL if block.reason is not None]
    assert [f"{block}: {block.reason}" for block in left_out if not block.reason.startswith(REASONS)] == []
    assert len(left_out) <= MOST_UNRUN
    # The rule cannot pass because no block is found.
    assert len(ALL) - len(left_out) > 30


def test_marks_are_known():
    known = ("not run: ", "joint map", "test command", "demo command")
    assert [f"{block}: {block.mark}" for block in ALL if block.mark and not block.mark.startswith(known)] == []


def test_every_language_is_read():
    assert {block.language for block in ALL} <= {"sh", "python", "toml", "json", "text"}
