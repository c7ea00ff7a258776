"""Many independent cases: one pool of job slots, worker processes, results kept as they come."""

from thesislib.studies.cases import StudyError, log_to_run, run
from thesislib.studies.slots import Slots, jobs, slots
from thesislib.studies.store import Result, stored

__all__ = ["Result", "Slots", "StudyError", "jobs", "log_to_run", "run", "slots", "stored"]
