"""A recording as an MP4 file (H.264), by imageio-ffmpeg, which brings a program ffmpeg along."""
from __future__ import annotations

import tempfile
from pathlib import Path

from .camera import usual_camera
from .picture import drawn

WIDTH, HEIGHT = 1280, 720
_BRIEF = {"smooth": 2, "shadow": 2048, "neighbours": 12}


def frames_per_second(times) -> float:
    """Of a recording, on average (they are at the nearest steps); 30 where it has one frame. times: s."""
    return float(round((len(times) - 1) / (times[-1] - times[0]), 3)) if len(times) > 1 else 30.0


def mp4_of(recording, width: int = WIDTH, height: int = HEIGHT, camera=None) -> bytes:
    """The file's bytes. width, height: even, pixels; camera: Camera, or None: what moves in view."""
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise ImportError("MP4 files need the package imageio-ffmpeg: pip install imageio-ffmpeg") from error
    camera = camera or usual_camera(recording)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        writer = imageio_ffmpeg.write_frames(
            str(path), (width, height), fps=frames_per_second(recording.times), codec="libx264", macro_block_size=2,
            quality=8, ffmpeg_log_level="error")
        writer.send(None)
        try:
            for frame in range(len(recording.times)):
                writer.send(drawn(recording.description, *recording.poses(frame), camera, width, height, **_BRIEF))
        finally:
            writer.close()
        return path.read_bytes()
