"""The demo's page: what it shows is there, what the colours mean stands there, and its commands work."""

import re
import shlex

from pegbar.cli.demo_page import demo_sections, next_step
from pegbar.cli.main import COMMANDS, app


def test_skeletons_and_depths_have_their_colours_explained():
    sections = {section.title: section for section in demo_sections()}
    assert [what for _, what in sections["2. Lifted to 3D"].legend][:2] == [
        "the character's left",
        "the character's right",
    ]
    assert "nearest" in dict(map(reversed, sections["... or rendered elsewhere"].legend))
    for title, section in sections.items():
        assert section.words, title
        assert section.pictures, title


def test_the_next_step_leads_to_the_guide_and_its_commands_are_commands():
    step = next_step()
    assert "docs/getting-started.md" in " ".join(step.words)
    lines = [*step.commands, *(line for section in demo_sections() for line in section.commands)]
    told = set()
    for line in lines:
        program, command, *arguments = shlex.split(re.sub(r"\s+#.*", "", line))
        assert program == "pegbar"
        told.add(command)
        # Every argument is one that the command knows.
        app.parse_args([command, *arguments], exit_on_error=False, print_error=False)
    assert told <= set(COMMANDS)
    assert {"init", "dots", "check", "match", "align", "secondary", "lift", "report", "animate"} <= told
