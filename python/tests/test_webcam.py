"""Hands before a camera: from landmarks to joints, without a camera."""
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from subadmm import hands
from subadmm.hands import webcam
from subadmm.hands.webcam import Tracker, in_camera
from subadmm.rotations import rotate

WIDTH, HEIGHT, FIELD = 640, 480, 1.1


def before_camera(side="right"):
    """Joints, m, in the frame of a camera that sees the hand 0.6 m away, tilted."""
    turn = np.array([0.7, 0.5, -0.4, 0.3]) / np.linalg.norm([0.7, 0.5, -0.4, 0.3])
    return hands.grasping(side, (0.08, -0.05, 0.6), turn, 0.06)


def landmarks(joints):
    """(image, shape) as mediapipe has them: places in the picture of a pinhole camera, and m from the hand's middle."""
    focal = WIDTH / 2 / np.tan(FIELD / 2)
    image = focal * joints[:, :2] / joints[:, 2:] / [WIDTH, HEIGHT] + 0.5
    return image, joints - joints.mean(axis=0)


def test_a_hand_is_where_the_camera_sees_it():
    joints = before_camera()
    assert np.allclose(in_camera(*landmarks(joints), WIDTH, HEIGHT, FIELD), joints, atol=1e-12)
    # The places of a camera, to half a pixel: the hand, 0.1 m wide, is seen 80 pixels wide; 0.6 m away to 2 cm.
    image, shape = landmarks(joints)
    noise = np.random.default_rng(5).uniform(-0.5, 0.5, image.shape) / [WIDTH, HEIGHT]
    assert np.abs(in_camera(image + noise, shape, WIDTH, HEIGHT, FIELD) - joints).max() < 0.02
    # Seen twice as large as it is, it is half as far away.
    near = in_camera(image, shape / 2, WIDTH, HEIGHT, FIELD)
    assert near.mean(axis=0) == pytest.approx(joints.mean(axis=0) / 2, rel=1e-9)


@pytest.mark.parametrize("change, error, said", [
    (lambda image, shape: (image[:20], shape), TypeError, "image: must be 21 x 2"),
    (lambda image, shape: (image, shape[:, :2]), TypeError, "shape: must be 21 x 3"),
    (lambda image, shape: (image * np.nan, shape), ValueError, "image: must be finite"),
    (lambda image, shape: (image, -shape), ValueError, "no place before the camera"),     # it would be behind
    (lambda image, shape: (image * 0 + 0.5, shape * 0), ValueError, "no place before the camera"),
])
def test_landmarks_that_are_none_are_refused(change, error, said):
    with pytest.raises(error, match=said):
        in_camera(*change(*landmarks(before_camera())), WIDTH, HEIGHT, FIELD)
    with pytest.raises(ValueError, match="field: 4"):
        in_camera(*landmarks(before_camera()), WIDTH, HEIGHT, 4)


def test_mediapipe_is_imported_only_when_it_is_asked_for(monkeypatch):
    code = "import sys, subadmm.hands.webcam; sys.exit(any(name in sys.modules for name in ('mediapipe', 'cv2')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    with pytest.raises(ImportError, match="pip install 'mediapipe"):
        Tracker("hand_landmarker.task")


class FakeMediapipe:
    """What Tracker needs of mediapipe; a landmarker that finds `found`, in order."""

    def __init__(self):
        self.found, self.times, self.shapes = [], [], []
        self.tasks = SimpleNamespace(BaseOptions=SimpleNamespace, vision=SimpleNamespace(
            HandLandmarkerOptions=SimpleNamespace, RunningMode=SimpleNamespace(VIDEO="video"),
            HandLandmarker=SimpleNamespace(create_from_options=self.create)))
        self.ImageFormat = SimpleNamespace(SRGB="srgb")

    def Image(self, image_format, data):
        assert image_format == "srgb" and data.flags.c_contiguous
        return data

    def create(self, options):
        self.options = options
        return SimpleNamespace(detect_for_video=self.detect, close=lambda: None)

    def detect(self, image, milliseconds):
        self.times.append(milliseconds)
        self.shapes.append(image.shape)
        return SimpleNamespace(
            handedness=[[SimpleNamespace(category_name=name, score=score)] for name, score, _ in self.found],
            hand_landmarks=[[SimpleNamespace(x=x, y=y, z=0) for x, y in landmarks(joints)[0]]
                            for _, _, joints in self.found],
            hand_world_landmarks=[[SimpleNamespace(x=x, y=y, z=z) for x, y, z in landmarks(joints)[1]]
                                  for _, _, joints in self.found])


@pytest.fixture
def fake(monkeypatch):
    made = FakeMediapipe()
    monkeypatch.setitem(sys.modules, "mediapipe", made)
    return made


def test_a_tracker_gives_joints_in_the_world(fake, tmp_path):
    model = tmp_path / "hand_landmarker.task"
    with pytest.raises(FileNotFoundError, match="hand landmarker"):
        Tracker(model)
    model.write_bytes(b"")
    tracker = Tracker(model, field=FIELD, position=(1, 0, 0.3))
    assert fake.options.num_hands == 2 and fake.options.base_options.model_asset_path == str(model)
    right, left = before_camera(), before_camera("left")
    fake.found = [("Right", 0.9, right), ("Left", 0.8, left), ("Right", 0.95, right + [0.1, 0, 0]), ("None", 1, left)]
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)[:, :, ::-1]
    seen = tracker.track(picture, 0.5)
    # The camera looks to -x: what is 0.6 m ahead of it is at x = 0.4; its right is y, its down is -z.
    ahead = np.stack([1 - right[:, 2], right[:, 0] + 0.1, 0.3 - right[:, 1]], axis=1)
    assert np.allclose(seen["right"], ahead, atol=1e-9)                     # the surer one
    assert np.allclose(seen["left"], [1, 0, 0.3] + rotate(np.array(webcam.FACING), left), atol=1e-9)
    fake.found = []
    assert tracker.track(picture, 0.5) == {"left": None, "right": None}
    assert fake.times == [500, 501] and fake.shapes == [(HEIGHT, WIDTH, 3)] * 2     # mediapipe wants later times
    for wrong in (np.zeros((HEIGHT, WIDTH)), np.zeros((HEIGHT, WIDTH, 3)), np.zeros((HEIGHT, WIDTH, 4), np.uint8)):
        with pytest.raises(TypeError, match="picture"):
            tracker.track(wrong, 1)
    tracker.close()
    for wrong in ({"field": 0}, {"orientation": (0, 0, 0, 0)}, {"position": (0, 0, float("nan"))}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Tracker(model, **wrong)


def test_a_camera_that_is_none_is_an_error(fake, tmp_path):
    pytest.importorskip("cv2")
    model = tmp_path / "hand_landmarker.task"
    model.write_bytes(b"")
    with pytest.raises(OSError, match="device: 999; no camera"):
        next(Tracker(model).watch(999))


def test_mediapipe_has_what_is_used_and_refuses_a_file_that_is_no_model(tmp_path):
    pytest.importorskip("mediapipe", exc_type=ImportError)
    model = tmp_path / "hand_landmarker.task"
    model.write_bytes(b"no model")
    with pytest.raises((RuntimeError, ValueError)):
        Tracker(model)
