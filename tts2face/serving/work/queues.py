"""Names of what DBOS keeps: workflows and their table, and queues with their places."""

from collections.abc import Mapping
from types import MappingProxyType

from tts2face.serving.batch.content_address import SEGMENT_FORMAT

APPLICATION = "tts2face"
APPLICATION_VERSION = f"segments-{SEGMENT_FORMAT}"  # pinned: workers of equal segments share their work
WORKFLOW, JOB_WORKFLOW = "render_segment", "run_job"
WORK = "work"  # call of the process of a worker
QUEUE = "tts2face-segments"
JOB_QUEUE = "tts2face-jobs"
TALKER_QUEUE = "tts2face-talkers"
# DBOS' table of workflows by the kind of database. Whether a job waits or runs is read there, and written nowhere else.
WORKFLOWS = {"sqlite": "workflow_status", "postgresql": "dbos.workflow_status"}
# Places of each queue in each worker (`worker_concurrency`; `concurrency` would count the jobs of the dead, too).
PLACES: Mapping[str, int] = MappingProxyType({
    QUEUE: 2,  # one segment is rendered, one waits, so that no time is lost between them
    JOB_QUEUE: 4,  # jobs mostly wait for their segments; they never occupy the places of segments
    TALKER_QUEUE: 1,  # a build takes a core and 1 GB for minutes; it never occupies the places of other jobs
})  # fmt: skip
