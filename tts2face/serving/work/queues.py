"""Names of what DBOS keeps: queues, workflows and the version of the application."""

from tts2face.serving.batch.segment import SEGMENT_FORMAT

QUEUE = "tts2face-segments"
APPLICATION = "tts2face"
APPLICATION_VERSION = f"segments-{SEGMENT_FORMAT}"  # pinned: workers of equal segments share their work
WORKFLOW = "render_segment"
WORK = "work"  # call of the process of a worker
JOB_QUEUE, JOB_WORKFLOW = "tts2face-jobs", "run_job"  # of the service; a job waits for its segments
TALKER_QUEUE = "tts2face-talkers"  # of jobs that compute for minutes; they never occupy the places of others
