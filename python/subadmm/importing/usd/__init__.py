"""USD stages with UsdPhysics schemas as worlds, read by usd-core. docs/guide/importing.md says what is carried over."""

from .bodies import add_bodies
from .filters import Filters
from .joints import add_joints
from .leftover import report_leftover
from .stage import Reader, gravity_of, open_stage


def load_stage(path, settings, threshold, **options):
    """A LoadedStage of a file or an open stage. settings: Settings or None; threshold: of decompose, or None;
    options: of World."""
    from ... import Settings, World
    from ..model import LoadedStage, Report

    report = Report()
    stage = open_stage(path)
    reader = Reader(stage, report, threshold)
    gravity = gravity_of(reader)
    if settings is None:
        settings = Settings(gravity=gravity)
    loaded = LoadedStage(World(settings=settings, **options), stage, report, reader.turn)
    filters = Filters(reader)
    add_bodies(loaded, reader, filters)
    add_joints(loaded, reader)
    filters.ignore(loaded)
    report_leftover(reader)
    return loaded
