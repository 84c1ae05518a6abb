"""The documentation is true: its code runs, its reference is what the code says, its links lead somewhere."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "data" / "samples" / "README.md"])


def test_the_tutorial_runs(capsys):
    text = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.S)
    assert len(blocks) >= 5
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/tutorial.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "small_angle fails" in printed
    assert "linear_drag fails" in printed
    # ω_g² = g/ℓ, so for θ₀ = 1 the solution at 10 s is the tabulated one
    assert "-0.777341381 rad" in printed


def test_the_reference_is_what_the_code_says():
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    for name, content in generate.pages().items():
        on_disk = (ROOT / "docs" / "reference" / name).read_text(encoding="utf-8")
        assert on_disk == content, f"docs/reference/{name} is out of date: run python docs/generate.py"


def test_every_command_and_option_is_documented():
    import typer.main

    import cli

    page = (ROOT / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    for name, command in typer.main.get_command(cli.app).commands.items():
        assert f"## pendulab {name}" in page
        assert command.help, f"{name} has no help"
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert parameter.help, f"{name} {parameter.opts} has no help"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if not re.match(r"[a-z]+:", target):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", [p for p in PAGES if p.name != "add-an-effect.md"], ids=lambda p: p.name)
def test_files_that_are_named_are_there(page):
    for name in re.findall(r"`((?:toolkit|tests|benchmarks|docs|data)/[\w./-]+)`", page.read_text(encoding="utf-8")):
        assert "NAME" in name or "LANG" in name or (ROOT / name).exists(), f"{page.name} names {name}"


def test_the_site_map_names_every_page():
    site = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("**/*.md"):
        assert str(page.relative_to(ROOT / "docs")).replace("\\", "/") in site, page


def test_no_page_or_file_names_a_machine():
    for path in [*PAGES, *ROOT.glob("toolkit/**/*.py"), *ROOT.glob("tests/*.py"), *ROOT.glob("benchmarks/**/*.py")]:
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"/(home|root|Users)/\w", text), path


def test_versions_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    import toolkit

    assert project["version"] == toolkit.__version__
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
