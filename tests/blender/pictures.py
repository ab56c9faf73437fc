"""Make the pictures of the add-on in docs/ from what `make test-blender` left: ``python tests/blender/pictures.py``."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, linear_to_srgb

ROOT = Path(__file__).parents[2]
SEEN = ROOT / "build" / "test-blender" / "pictures"
MADE = ROOT / "build" / "test-blender" / "debian" / "plume"
DOCS = ROOT / "docs"

SIDEBAR = (1042, 78, 1300, 900)
"""Where the tab is in a picture of the screen: left, top, right, bottom."""

STAGES = ("idle", "running", "done")
FRAME = 30
GAP = 8
COLOURS = 256


def main() -> None:
    """Write them."""
    panels = [Image.open(SEEN / f"view_3d_{stage}.png").convert("RGB").crop(SIDEBAR) for stage in STAGES]
    save("blender_panel.png", beside(panels))
    window = Image.open(SEEN / "view_3d_done.png").convert("RGB")
    save("blender_window.png", window.resize((1200, 750), Image.Resampling.LANCZOS))
    renders = [Image.open(MADE / name).convert("RGB") for name in ("as_filmed.png", "from_left.png", "elsewhere.png")]
    with Clip.open(ROOT / "examples" / "plume" / "clip.mp4") as clip:
        filmed = linear_to_srgb(area_average(clip.frame(FRAME - 1), *renders[0].size))
    save("blender_render.png", beside([Image.fromarray((255 * filmed + 0.5).astype("uint8")), *renders]))


def beside(pictures: list[Image.Image]) -> Image.Image:
    """Pictures in one row."""
    width = sum(picture.width for picture in pictures) + GAP * (len(pictures) - 1)
    row = Image.new("RGB", (width, max(picture.height for picture in pictures)), "white")
    left = 0
    for picture in pictures:
        row.paste(picture, (left, 0))
        left += picture.width + GAP
    return row


def save(name: str, picture: Image.Image) -> None:
    """Write a picture that takes little room."""
    picture.quantize(COLOURS, dither=Image.Dither.FLOYDSTEINBERG).save(DOCS / name, optimize=True)


if __name__ == "__main__":
    main()
