"""Make the pictures of the add-on in docs/ from what `make test-blender` left.

python -m benchmarks.blender.pictures
"""

from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[2]
SEEN = ROOT / "build" / "test-blender" / "pictures"
DOCS = ROOT / "docs"

SIDEBAR = (1042, 78, 1300, 900)
"""Where the tab is in a picture of the screen: left, top, right, bottom."""

SUB_PANEL = (1042, 78, 1300, 440)
"""And a sub-panel by itself."""

SUB_PANELS = ("results", "advanced", "look", "set_up", "direct", "export")
STAGES = ("qualities", "view_3d_running", "view_3d_done")
GAP = 8
COLORS = 256


def main() -> None:
    """Write them."""
    panels = [Image.open(SEEN / f"{stage}.png").convert("RGB").crop(SIDEBAR) for stage in STAGES]
    save("blender_panel.png", beside(panels))
    alone = [
        Image.open(file).convert("RGB").crop(SUB_PANEL) for file in (SEEN / f"sub_panel_{n}.png" for n in SUB_PANELS)
    ]
    save("blender_subpanels.png", beside(alone))
    window = Image.open(SEEN / "view_3d_done.png").convert("RGB")
    save("blender_window.png", window.resize((1200, 750), Image.Resampling.LANCZOS))


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
    """Write a picture of the docs that takes little room: dithered, in the colors that are farthest apart.

    So white is among them. A name may be a whole path.
    """
    # Pillow dithers only to a palette that is there already
    palette = picture.quantize(COLORS, Image.Quantize.MAXCOVERAGE)
    picture.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(DOCS / name, optimize=True)


if __name__ == "__main__":
    main()
