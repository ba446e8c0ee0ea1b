"""Where something is: recognising places."""

from __future__ import annotations

from typing import Optional

from relmap.aio.base import ClientBase
from relmap.ids import FrameLike, frame_message
from relmap.pictures import PictureLike
from relmap.places import Localisation, PlaceMatches, read_localisation, read_matches
from relmap.v1 import map_pb2
from relmap.views import CameraLike, ViewLike, as_view


class PlaceCalls(ClientBase):
    """Calls that recognise places."""

    async def localise(
        self,
        view: ViewLike,
        right: Optional[PictureLike] = None,
        *,
        camera: Optional[CameraLike] = None,
        prior: Optional[FrameLike] = None,
        correspondences: bool = False,
        timeout: Optional[float] = None,
    ) -> Localisation:
        """Recognises the place of a view, and returns the view's pose relative to a frame there, in metres.

        Args:
            view: a View, a frame (what it saw), or a picture: a path, the bytes of a JPEG or PNG file, or an array of uint8
                (H x W, or H x W x 3 in RGB).
            right: the right picture of a stereo pair.
            camera: that took the pictures: a session of the map (its number, name or uuid), a RawStereo, or a StereoCamera if they are rectified; None:
                not known, and the focal length is estimated.
            prior: a frame near the view: its surroundings are searched first.
            correspondences: with the points that the view and the frame both show.

        Raises:
            PlaceNotRecognised: NEW_PLACE, AMBIGUOUS_PLACE, TOO_FEW_INLIERS, EMPTY_MAP, ...
            RequestError: NO_CALIBRATION, WRONG_CALIBRATION, BAD_SIZE (the picture and its camera differ in size), NOT_STEREO,
                NO_SUCH_FRAME, NO_SUCH_SESSION, a damaged picture, ...
            CameraError: ROWS_APART: the pair is not rectified.
        """
        countdown = self._caller.countdown(timeout)
        seen = await self._with_camera(as_view(view, right, camera), countdown)
        request = map_pb2.LocaliseRequest(view=seen.message, correspondences=correspondences)
        if prior is not None:
            request.prior.CopyFrom(frame_message(prior))
        return read_localisation(await self._ask(self._map.Localise, request, countdown), correspondences)

    async def match_image(
        self,
        view: ViewLike,
        right: Optional[PictureLike] = None,
        *,
        camera: Optional[CameraLike] = None,
        max_places: int = 0,
        max_verified: int = 0,
        thumbnails: bool = False,
        near: Optional[FrameLike] = None,
        correspondences: bool = False,
        timeout: Optional[float] = None,
    ) -> PlaceMatches:
        """The places that a picture of any camera could show, and the probability that it shows none of them.

        Args:
            view, right, camera: as in localise().
            max_places: how many to return; 0: 20.
            max_verified: on how many geometry is tried; 0: 10, at most 20.
            thumbnails: with thumbnails of the places.
            near: a frame supposed to be near: places around it are more likely.
            correspondences: with the points that the view and each place both show.

        Raises:
            PlaceNotRecognised: EMPTY_MAP, TOO_FEW_FEATURES. If nothing is recognised, the call succeeds, and the
                result's `reason` says why.
            RequestError: as localise().
        """
        countdown = self._caller.countdown(timeout)
        seen = await self._with_camera(as_view(view, right, camera), countdown)
        request = map_pb2.MatchImageRequest(
            view=seen.message,
            max_places=max_places,
            max_verified=max_verified,
            thumbnails=thumbnails,
            correspondences=correspondences,
        )
        if near is not None:
            request.near.CopyFrom(frame_message(near))
        return read_matches(await self._ask(self._map.MatchImage, request, countdown), correspondences)
