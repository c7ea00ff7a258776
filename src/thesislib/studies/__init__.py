"""Many independent cases: one pool of job slots, worker processes or a cluster, results kept as they come."""

from thesislib.studies.cases import StudyError, run
from thesislib.studies.cluster import ClusterError
from thesislib.studies.slots import Slots, jobs, slots
from thesislib.studies.store import Result, stored
from thesislib.studies.work import log_to_run

__all__ = ["ClusterError", "Result", "Slots", "StudyError", "jobs", "log_to_run", "run", "slots", "stored"]
