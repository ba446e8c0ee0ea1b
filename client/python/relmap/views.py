"""Views: what a place is recognised by. A picture, a stereo pair, features, or what a frame of the map saw."""

from __future__ import annotations

import copy
import os
import re
from dataclasses import dataclass, field
from typing import Optional, Union

import numpy as np

from relmap.camera import RawStereo, StereoCamera, camera_message, raw_message
from relmap.ids import FrameId, HasFrameId, SessionLike, as_frame, as_session, frame_message
from relmap.measurements import Features, feature_set_message
from relmap.pictures import KINDS_OF_PICTURES, PictureLike, picture_bytes
from relmap.v1 import common_pb2

CameraLike = Union[StereoCamera, RawStereo, SessionLike]
"""The camera that took a view: a rectified one (the pictures are rectified), a rig before rectification (they are not),
or a session of the map (its number, name or uuid, or a Session), whose camera took the raw pictures."""


@dataclass(frozen=True, eq=False)
class View:
    """A view, encoded once: localise several times, or with several priors, at no further cost.

    Exactly one of `left`, `features` and `frame` is given. ValueError: more or less is, or the parts do not go together.

    Attributes:
        left: the left picture, or the only one.
        right: the right picture of a stereo pair.
        features: instead of pictures; they need a camera.
        frame: instead of pictures: what this frame of the map saw. Its own recent past is excluded from the answers.
        camera: None: not known. Then the focal length is estimated if a pose in metres is asked for.
        rectified: with a session as camera: the pictures are rectified already.
        supposed: the camera is only assumed; the covariance allows for another one.
        either_eye: with a session and one picture: it is not known which eye of the rig took it.
        camera_called: the name or uuid by which `camera` names a session, since only the map tells its number; else None.
    """

    left: Optional[PictureLike] = None
    right: Optional[PictureLike] = None
    features: Optional[Features] = None
    frame: Optional[FrameId] = None
    camera: Optional[CameraLike] = None
    rectified: bool = False
    supposed: bool = False
    either_eye: bool = False
    camera_called: Optional[str] = field(init=False, repr=False, default=None)
    _message: common_pb2.View = field(init=False, repr=False)

    def __post_init__(self) -> None:
        given = [name for name in ("left", "features", "frame") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("a view is one of left, features and frame; given: " + (", ".join(given) or "nothing"))
        if self.right is not None and self.left is None:
            raise ValueError("a right picture needs a left one")
        if self.features is not None and self.camera is None:
            raise ValueError("features need a camera")
        if self.frame is not None and self.camera is not None:
            raise ValueError("a frame of the map has its session's camera; name none")
        message = common_pb2.View(rectified=self.rectified, supposed=self.supposed, either_eye=self.either_eye)
        if self.left is not None:
            message.left.data = picture_bytes(self.left)
        elif self.features is not None:
            message.features.CopyFrom(feature_set_message(self.features))
        elif self.frame is not None:
            message.frame.CopyFrom(frame_message(self.frame))
        if self.right is not None:
            message.right.data = picture_bytes(self.right)
        if isinstance(self.camera, StereoCamera):
            message.camera.CopyFrom(camera_message(self.camera))
        elif isinstance(self.camera, RawStereo):
            message.raw.CopyFrom(raw_message(self.camera))
        elif self.camera is not None:
            session = as_session(self.camera, "a camera other than StereoCamera and RawStereo")
            if isinstance(session, str):
                object.__setattr__(self, "camera_called", session)
            else:
                message.session = session
        object.__setattr__(self, "_message", message)

    @property
    def message(self) -> common_pb2.View:
        """The view as a message. Do not change it. Without the camera if `camera_called` is set: see of_session()."""
        return self._message

    def of_session(self, number: int) -> "View":
        """The same view, whose camera is that of the session of this number. Pictures are not encoded again."""
        message = common_pb2.View()
        message.CopyFrom(self._message)
        message.session = number
        view = copy.copy(self)
        object.__setattr__(view, "camera", number)
        object.__setattr__(view, "camera_called", None)
        object.__setattr__(view, "_message", message)
        return view


ViewLike = Union[View, FrameId, HasFrameId, PictureLike]
"""A view, a frame of the map (what it saw; its text "3:120", too), or a picture: a path, bytes, or an array of uint8."""


def as_view(view: ViewLike, right: Optional[PictureLike] = None, camera: Optional[CameraLike] = None) -> View:
    """The view that is meant. ValueError: `right` or `camera` beside a View, or what View refuses. TypeError: it is none."""
    if isinstance(view, View):
        if right is not None or camera is not None:
            raise ValueError("a View has its right picture and its camera itself")
        return view
    if isinstance(view, FrameId) or isinstance(getattr(view, "id", None), FrameId):
        return View(frame=as_frame(view), right=right, camera=camera)  # type: ignore[arg-type]
    if isinstance(view, str) and re.fullmatch(r"\d+:\d+", view):
        return View(frame=FrameId.parse(view), right=right, camera=camera)
    if isinstance(view, (str, os.PathLike, bytes, np.ndarray)):
        return View(left=view, right=right, camera=camera)
    raise TypeError(f"a view is a View, a FrameId, or {KINDS_OF_PICTURES}, not {type(view).__name__}")


