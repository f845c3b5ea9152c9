"""The kinds of jobs, by the names that clients send."""

from tts2face.serving.service.job_kinds.clip import CLIP_KIND
from tts2face.serving.service.job_kinds.order import JobKind
from tts2face.serving.service.job_kinds.subtitles import SUBTITLES_KIND
from tts2face.serving.service.job_kinds.talker import TALKER_KIND

JOB_KINDS: dict[str, JobKind] = {"clip": CLIP_KIND, "subtitles": SUBTITLES_KIND, "talker": TALKER_KIND}
