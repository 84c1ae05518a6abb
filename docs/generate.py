"""Write the pages of the reference that the code itself can tell: commands, effects, models, localisers.

python docs/generate.py            write docs/reference/*.md
python docs/generate.py --check    say which pages are out of date; exit 1 if any
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

REFERENCE = Path(__file__).resolve().parent / "reference"
sys.path.insert(0, str(REFERENCE.parents[1]))


def commands_page() -> str:
    """Every command with its arguments and options, from the command line's own definition."""
    import typer.main

    import cli

    group = typer.main.get_command(cli.app)
    lines = ["# Commands", "", "`pendulab CMD` and `python cli.py CMD` are the same.", ""]
    for name, command in sorted(group.commands.items()):  # type: ignore[attr-defined]
        lines += [f"## pendulab {name}", "", (command.help or "").strip(), ""]
        rows = []
        for parameter in command.params:
            if parameter.param_type_name == "argument":
                label = parameter.metavar or parameter.name.upper()
                text = getattr(parameter, "help", None) or ("required" if parameter.required else "")
            else:
                label = ", ".join(parameter.opts)
                text = parameter.help or ""
                if parameter.default not in (None, False, []) and not callable(parameter.default):
                    text += f" Default: {parameter.default}."
            rows.append(f"| `{label}` | {text.replace('|', chr(92) + '|')} |")
        if rows:
            lines += ["| argument or option | meaning |", "|---|---|", *rows, ""]
    return "\n".join(lines)


def listing_page(title: str, command: str, text: str) -> str:
    """A page that tells what one of the listings says: a heading a part, its equation set, its parameters in a table."""
    lines = [f"# {title}", ""]
    if command:
        lines += [f"`pendulab {command}` prints the same.", ""]
    for block in text.rstrip().split("\n\n"):
        name, *rest = block.splitlines()
        if not rest or not rest[0].startswith("  "):  # a note under the parts
            lines += [" ".join(block.split()), ""]
            continue
        part, bracket, remark = name.partition(" (")
        meaning = f"{rest[0].strip().rstrip('.')}."
        lines += [f"## {part}", "", f"{meaning[0].upper()}{meaning[1:]}{bracket}{remark}", ""]
        parameters, others = [], []
        for line in rest[1:]:
            parameter = re.fullmatch(r"  (\w+) \[(.*?)\]  (.*?)(?: \(([^()]*(?:\([^()]*\)[^()]*)*)\))?", line)
            if parameter:
                symbol, *cells = parameter.groups("")
                parameters.append(f"| `{symbol}` | {' | '.join(map(_cell, cells))} |")
                continue
            key, said = line.strip().split(None, 1)
            if key == "equation":
                lines += ["$$", said, "$$", ""]
            else:
                others.append(f"- **{key}**: {_cell(said)}")
        if parameters:
            lines += ["| parameter | unit | meaning | range |", "|---|---|---|---|", *parameters, ""]
        lines += [*others, ""] if others else []
    return "\n".join(lines)


def _cell(text: str) -> str:
    """Text that Markdown leaves as it is."""
    return re.sub(r"([|*_<])", r"\\\1", text)


def pages() -> dict[str, str]:
    """File name -> content of every generated page."""
    from toolkit import catalogue

    return {
        "commands.md": commands_page(),
        "effects.md": listing_page("What can act on a pendulum", "effects", catalogue.describe_effects(str)),
        "models.md": listing_page("What can be fitted", "models", catalogue.describe_models(str)),
        "camera.md": listing_page("What a rendered camera can do", "", catalogue.describe_camera_effects()),
        "trackers.md": listing_page("What can localise a bob", "trackers", catalogue.describe_trackers()),
    }


def main() -> int:
    """Write or check the pages."""
    stale = []
    for name, content in pages().items():
        path = REFERENCE / name
        if path.is_file() and path.read_text(encoding="utf-8") == content:
            continue
        stale.append(name)
        if "--check" not in sys.argv:
            path.parent.mkdir(exist_ok=True)
            path.write_text(content, encoding="utf-8")
    if "--check" in sys.argv and stale:
        print(f"out of date: {', '.join(stale)}; run python docs/generate.py")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
