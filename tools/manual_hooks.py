"""What MkDocs does besides its own to build the manual; see `mkdocs.yml` and `make manual`.

Pages hold ``<!-- made by tools/NAME.py -->`` where what that script prints belongs, so what the manual lists is always
what the code has. Equations become MathML, which browsers show without a script. Pages of the checkout beside `docs/`
join the manual.
"""

import html
import re
from pathlib import Path
from typing import Any

import latex2mathml.converter
from mkdocs.structure.files import File

import command_reference
import constants
import messages
import notebook
import scene_reference

ROOT = Path(__file__).resolve().parents[1]
MAKERS = {module.__name__: module for module in (command_reference, constants, messages, notebook, scene_reference)}

MADE = re.compile(r"<!-- made by tools/(\w+)\.py -->")
EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
CODE = re.compile(r"`[^`\n]+`")
JOINING = {"ARCHITECTURE.md": "architecture.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that lie beside `docs/`, with their links as they are from within."""
    for name, inside in JOINING.items():
        text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
        for other, place in JOINING.items():
            text = text.replace(f"]({other}", f"]({place}")
        files.append(File.generated(config, inside, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put in what the scripts print, and the bars in code as Python's Markdown reads them: without a backslash."""
    made = MADE.sub(lambda match: MAKERS[match[1]].markdown(), markdown)
    return CODE.sub(lambda match: match[0].replace("\\|", "|"), made)


def on_page_content(content: str, **_: Any) -> str:
    """Turn equations into MathML."""

    def mathml(match: re.Match[str]) -> str:
        display = "block" if match[2] == "[" else "inline"
        return str(latex2mathml.converter.convert(html.unescape(match[3]), display=display))

    return EQUATION.sub(mathml, content)
