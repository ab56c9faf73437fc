"""No more model than the scene needs: what a run is made of, chosen by measurement on the clip at low resolution.

``detail`` chooses the resolution, before there is a grid. Then `choose_model` fits a coarse density (``coarse``) to the
frames with the most smoke and chooses everything else: ``directions`` of an environment, ``scattering``, ``motion``
(grids of a velocity). What the user says is not measured. Everything is deterministic, so a run that goes on chooses
the same.
"""

from __future__ import annotations

from smokelift.selection.choice import Choice
from smokelift.selection.detail import Detail, smoke_detail
from smokelift.selection.model import Model, choose_model

__all__ = ["Choice", "Detail", "Model", "choose_model", "smoke_detail"]
