"""The tab: what is in it, in Blender's words, at the width that Blender gives it."""

from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from addon.core.contract import MOVING_CAMERA, QUALITIES
from addon.core.take import Take
from addon.result import command_line, shot_check
from addon.result.smoke_takes import runs
from addon.scene import volume
from addon.scene.clip import clip_table
from addon.scene.smoke import active_smoke, new_smoke
from conftest import changed, known_run, made
from tests.example_shot import smoke

LETTERS = 34
"""Of a label without an icon, at most, at the width of the sidebar in a new window."""


FIGURES = {"resolution": [48, 48, 64], "seconds": 12, "memory": 2**28, "memory_free": 2**33, "disk": 3e7, "lost": 0.08}
"""What the engine says of a quality."""


class Layout:
    """Keeps the texts that are drawn and the buttons, as ``[identifier]``, in place of Blender's layout."""

    def __init__(self, texts: list[str]) -> None:
        object.__setattr__(self, "texts", texts)

    def __getattr__(self, name: str) -> Any:
        def draw(*values: Any, text: str = "", icon: str = "NONE", **_settings: Any) -> Layout:
            if name == "operator":
                self.texts.append(f"[{values[0].removeprefix('smokelift.')}]")
            self.texts.append(text if icon == "NONE" else f"{text}    ")
            return self

        return draw

    def __setattr__(self, _name: str, _value: Any) -> None:
        """Blender's layout has settings; here they change nothing."""


def drawn(scene: bpy.types.Scene, *panels: type, brush: object = None) -> list[str]:
    texts: list[str] = []
    tools = SimpleNamespace(image_paint=SimpleNamespace(brush=brush))
    manager = bpy.context.window_manager
    context = SimpleNamespace(scene=scene, window=None, tool_settings=tools, window_manager=manager)
    for kind in panels or (bpy.types.SMOKELIFT_PT_view,):
        kind.draw(SimpleNamespace(layout=Layout(texts)), context)
    return texts


def said(scene: bpy.types.Scene, *panels: type, **drawing: object) -> list[str]:
    """The texts of panels, or of the tab itself, without the room for icons."""
    return [text.strip() for text in drawn(scene, *panels, **drawing)]


def words(scene: bpy.types.Scene) -> str:
    return " ".join(said(scene))


def know(scene: bpy.types.Scene, doubts: Any = (), background_color: Any = None, **figures: Any) -> None:
    """The shot is checked, and all qualities have these figures."""
    details = {"qualities": dict.fromkeys(QUALITIES, FIGURES | figures), "background_color": background_color}
    details["facts"] = [{"what": "background", "short": "a picture"}]
    shot_check.state.settings, shot_check.state.error = shot_check.settings_text(smoke(scene)), ""
    shot_check.state.store(smoke(scene), details, list(doubts))


def test_no_line_is_cut_off(shot, tmp_path) -> None:
    figures = {"seconds": 86000.0, "memory": 112.4 * 2**30, "disk": 99.9e9, "lost": 0.123}
    for outcome in ("waiting", "running", "done", "failed"):
        job = known_run(smoke(shot), Take(tmp_path / outcome), outcome, "One word after the other. " * 5).job
        job.done, job.total, job.seconds_left = 1250, 2500, 80000.0
        job.doubts = [("not all is smoke", "This is a doubt. " * 5)]
    panels = (bpy.types.SMOKELIFT_PT_view, bpy.types.SMOKELIFT_PT_view_element, bpy.types.SMOKELIFT_PT_view_advanced)
    texts = []
    for mode in ("ESTIMATE", "FILE", "FRAMES", "COLOR"):
        smoke(shot).smokelift.plate_mode = mode
        know(shot, **figures)
        texts += drawn(shot, *panels)
    bpy.ops.smokelift.new_mask()
    know(shot, **figures)
    texts += drawn(shot, *panels)
    assert {"24 h", "112 G", "100 G", "12%"} <= set(texts)
    assert [text for text in texts if len(text) > LETTERS] == []


def test_large_smoke_without_a_proxy_is_offered_one(shot, tmp_path) -> None:
    take = made(tmp_path)
    volume.show(smoke(shot), take)
    assert "This smoke is large" not in words(shot)
    with changed(take) as index:
        index["scene"]["domain"]["resolution"] = [160, 160, 240]
    assert "This smoke is large" in words(shot)


@pytest.mark.parametrize("name", ["longest_side", "fps", "overlap"])
def test_what_is_automatic_is_a_word_and_a_tick(shot, name) -> None:
    settings = smoke(shot).smokelift.directing if name == "overlap" else smoke(shot).smokelift
    smoke(shot).smokelift.directing.direction = "loop"
    panels = (bpy.types.SMOKELIFT_PT_view_advanced, bpy.types.SMOKELIFT_PT_view_direct)
    before = said(shot, *panels).count("Automatic")
    setattr(settings, f"use_{name}", True)
    assert getattr(settings, name) > 0
    assert said(shot, *panels).count("Automatic") == before - 1
    setattr(settings, f"use_{name}", False)
    assert getattr(settings, name) == 0


def test_frames_of_a_part_are_drawn_where_it_is_ticked(shot, tmp_path) -> None:
    """They may be of another result until then."""
    volume.show(smoke(shot), made(tmp_path))
    settings = smoke(shot).smokelift.directing
    settings.direction = "loop"
    whole = len(drawn(shot, bpy.types.SMOKELIFT_PT_view_direct))
    settings.use_part = True
    assert (settings.part_first, settings.part_last) == (1, 6)
    assert len(drawn(shot, bpy.types.SMOKELIFT_PT_view_direct)) == whole + 2


def test_pictures_after_a_gap_are_offered_and_used(scene, tmp_path, capsys) -> None:
    """And those that Blender does not know of because they were written after it read the first ones."""
    image = bpy.data.images.new("frame", 48, 32)
    for number in (17, 18, 20, 21, 22):
        image.save(filepath=str(tmp_path / f"frame_{number:04d}.png"))
    settings = smoke(scene).smokelift
    settings.clip = bpy.data.movieclips.load(str(tmp_path / "frame_0017.png"))
    assert (settings.first, settings.last) == (1, 2)
    assert "Missing: frame_0019.png." in words(scene) and "Blender sees 2 of 6 frames." in words(scene)
    command_line._smoke(command_line._parser().parse_args([]))
    assert "frame 1 of 5 (frame_0019.png missing)" in capsys.readouterr().out
    assert bpy.ops.smokelift.use_all_files() == {"FINISHED"}
    assert clip_table(smoke(scene))["frames"] == [0, 5]
    assert "Missing: frame_0019.png." in words(scene) and "Blender sees" not in words(scene)
    image.save(filepath=str(tmp_path / "frame_0023.png"))
    assert "Blender sees 2 of 7 frames." in words(scene)
    (tmp_path / "frame_0019.png").touch()
    bpy.ops.smokelift.use_all_files()
    assert "Missing" not in words(scene) and "Blender sees" not in words(scene)
    settings.last = 1
    assert "Missing" not in words(scene)


def test_every_quality_says_what_it_takes_and_loses(shot) -> None:
    """Also while another setting is estimated; nothing of another smoke, nor of a shot that is refused."""
    state, cells = shot_check.state, ("12 s", "0.2 G", "30 M", "8%")

    def shown() -> list[int]:
        return [drawn(shot).count(cell) for cell in cells]

    know(shot)
    assert shown() == [4, 4, 4, 4]
    smoke(shot).smokelift.albedo = 0.5
    assert not state.fits(smoke(shot))
    assert shown() == [4, 4, 4, 4]
    state.settings, state.error = shot_check.settings_text(smoke(shot)), "The box is flat."
    assert shown() == [0, 0, 0, 0]
    know(shot)
    state.of += 1
    state.done = False
    assert shown() == [0, 0, 0, 0]


def test_what_may_be_no_smoke_is_said_before_the_run_with_the_button_that_hides_it(shot) -> None:
    """Not while the shot is checked anew, and of no other smoke."""
    know(shot, [("not all may be smoke", "A person moves."), ("cut", "There is a cut.")], lost=None)
    texts = said(shot)
    place = texts.index("A person moves.")
    assert "[new_mask]" in texts[:place]  # beside Mask
    button = texts.index("[new_mask]", place)
    assert "Hide by a Mask" in " ".join(texts[place:button]) and texts[button + 1] == "New Mask"
    assert "There is a cut." in texts[button + 2 : button + 5]
    assert texts.index("[vary]") < place  # the buttons stay where they are
    other = new_smoke(shot, smoke(shot).smokelift.clip)
    assert active_smoke(shot) == other
    assert "A person moves." not in said(shot)
    bpy.data.objects.remove(other)
    smoke(shot).smokelift.albedo = 0.5
    assert "A person moves." not in said(shot)


def test_advice_leaves_out_what_is_set_and_is_given_once(shot, settings, tmp_path) -> None:
    """Also where a check and two runs doubt the same."""
    doubts = [("not all may be smoke", "A person moves.")]
    for outcome in ("done", "waiting"):
        known_run(smoke(shot), Take(tmp_path / outcome), outcome).job.doubts = [("not all is smoke", "A label.")]

    def said() -> str:
        know(shot, doubts)
        return " ".join(" ".join(drawn(shot, bpy.types.SMOKELIFT_PT_view)).split())

    assert "A person moves." not in said() and said().count("A label.") == 1
    runs.clear()
    settings.plate_mode = "ESTIMATE"
    assert "A person moves. Hide by a Mask what is no smoke or choose a Clean Plate." in said()
    settings.mask = str(tmp_path / "mask.png")
    assert "A person moves. Choose a Clean Plate." in said()
    settings.plate_mode = "FILE"
    assert "Mask smaller" in said() and "Clean Plate" not in said().partition("A person moves.")[2]


def test_a_camera_that_travels_is_said_with_the_button_that_tracks_it(shot, tmp_path) -> None:
    """In the check that ends with it or below the run, and below no other failure."""
    refused = f"{MOVING_CAMERA} from the clip. Stabilize the clip."
    shot_check.state.settings, shot_check.state.error = shot_check.settings_text(smoke(shot)), refused
    job = known_run(smoke(shot), Take(tmp_path), "failed", refused).job
    assert said(shot).count("Track or Stabilize") == 1
    assert bpy.ops.smokelift.show_clip() == {"FINISHED"}
    shot_check.state.error = job.sentence = "The box is flat."
    assert "Track or Stabilize" not in said(shot)


def buttons(texts: list[str]) -> int:
    """Lines from the top of the tab to the last button that makes something."""
    return texts.index("[vary]")


def test_buttons_do_not_move_while_the_clip_is_read_and_smoke_is_made(shot, tmp_path) -> None:
    """Whatever the check and the runs say stands below them; those of another smoke warn in its own tab."""
    state, refused = shot_check.state, f"{MOVING_CAMERA} from the clip."
    know(shot)
    places = [buttons(drawn(shot))]
    state.error = refused
    assert buttons(drawn(shot)) < said(shot).index("Track or Stabilize")
    know(shot)
    volume.show(smoke(shot), made(tmp_path))
    for outcome in ("done", "waiting", "running", "failed"):
        run = known_run(smoke(shot), Take(tmp_path / outcome), outcome, refused)
        run.job.doubts = [("not all is smoke", "A person moves.")]
        places.append(buttons(drawn(shot)))
    assert len(set(places)) == 1
    assert "[cancel]" in drawn(shot, bpy.types.SMOKELIFT_PT_view_direct)
    texts = said(shot)
    assert texts.count("[cancel]") == 2 and texts.count("A person moves.") == 1
    assert {"Track or Stabilize", "[show_take]"} <= set(texts)
    for run in runs:
        run.smoke += 1
    texts = said(shot)
    assert texts.count("[cancel]") == 2
    assert not {"A person moves.", "Track or Stabilize", "[show_take]"} & set(texts)


@pytest.mark.parametrize("name", ["plate", "mask"])
def test_pictures_are_chosen_among_pictures(shot, settings, tmp_path, name) -> None:
    """Blender's own button beside a path would list all files."""
    assert settings.bl_rna.properties[name].subtype == "NONE"
    kind = bpy.ops.smokelift.choose_picture.get_rna_type().properties
    assert kind["filter_image"].default and kind["filter_movie"].default
    assert drawn(shot).count("[choose_picture]") == 2
    assert bpy.ops.smokelift.choose_picture(setting=name, filepath=str(tmp_path / "a.png")) == {"FINISHED"}
    assert getattr(settings, name) == str(tmp_path / "a.png")


def test_a_box_that_is_moved_is_estimated_anew(shot) -> None:
    for mode in ("SCENE", "ESTIMATE"):
        smoke(shot).smokelift.camera_mode = mode
        bpy.context.view_layer.update()
        know(shot)
        smoke(shot).smokelift.box.scale.x *= 1.1
        bpy.context.view_layer.update()
        assert shot_check.state.fits(smoke(shot)) == (mode == "ESTIMATE")
