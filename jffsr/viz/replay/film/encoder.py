"""Pictures as an H.264 film in an .mp4 file, which browsers and slides play."""

from __future__ import annotations

import errno
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from jffsr.errors import InputError

# The colours of high-definition video, named in the file: players guess where it does not say.
_COLOURS = (
    "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p,"
    "setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv"
)
_CODEC = ["-c:v", "libx264", "-preset", "medium", "-crf", "20"]
# The index first, so that a page can play what it has not wholly loaded; a temporary file's name has no ending.
_FILE = ["-movflags", "+faststart", "-f", "mp4"]


def encoder() -> str:
    """The program that encodes; InputError where there is none."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "a video needs the package imageio-ffmpeg, which brings an H.264 encoder: pip install 'jffsr[show]'"
        ) from None
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError:
        raise InputError(
            "imageio-ffmpeg has no encoder for this system: install ffmpeg, or name one in IMAGEIO_FFMPEG_EXE"
        ) from None


def encode(pictures: Iterable[np.ndarray], path: Path, size: tuple[int, int], frames_per_second: int) -> None:
    """Write pictures (h, w, 3), 8 bits, of `size` (w, h) to `path` as mp4: H.264, yuv420p; OSError where it fails."""
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(frames_per_second)]
    command = [
        encoder(),
        "-y",
        "-loglevel",
        "error",
        *raw,
        "-i",
        "-",
        "-an",
        *_CODEC,
        "-vf",
        _COLOURS,
        *_FILE,
        str(path),
    ]
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors)
        try:
            try:
                with process.stdin as pipe:
                    for picture in pictures:
                        pipe.write(np.ascontiguousarray(picture))
            except BrokenPipeError:
                pass  # it has ended, and has said why
            if process.wait() != 0:
                raise _failure(errors, process.returncode)
        finally:
            process.kill()
            process.wait()


def _failure(errors, status: int) -> OSError:
    errors.seek(0)
    told = errors.read().decode(errors="replace").strip()
    if "No space left" in told:
        return OSError(errno.ENOSPC, "there is no room left on the disk")
    return OSError(f"the video's encoder ended with status {status}: {told[-500:]}")
