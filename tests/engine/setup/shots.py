"""Shots that the tests of `setup` look at."""

from __future__ import annotations

from smokelift.footage.clip import Clip
from smokelift.scene import Scene
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot


def shot_of(scene: Scene, settings: Settings) -> Shot:
    """Everything decided about a scene from its clip."""
    assert scene.clip is not None
    with Clip.open(scene.clip) as clip:
        return prepare_shot(clip, scene, settings)
