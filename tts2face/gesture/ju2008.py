"""The fields of Ju and Lee 2008 as published (section 5.1), to compare with the default ones."""

from collections.abc import Mapping
from types import MappingProxyType

from tts2face.gesture.field import FieldOptions
from tts2face.gesture.gesture_stream import OPTIONS
from tts2face.models.palette import FEATURES

# A draw at every frame from the four nearest of all recorded frames, h = 10 preceding frames at 30 frames a second, no
# bonus for the following frame, no memory of earlier draws, and recorded values shown as they are. The paper names
# alpha and sigma but prints no values; both were chosen within the training recordings (decision 066). Its distance
# is the sum over the h frames, that of a field their mean: the draw is the same with sigma h times as large.
JU_2008 = FieldOptions(
    history=10,
    candidates=4,
    alpha=(1.0, 1.0),
    sigma=0.1,
    stride=1,
    continuity=1.0,
    future=0,
    settle_s=0.0,
    memory=0,
    apart=1,
    search_error=1.0,
)
FIELD_OPTIONS: Mapping[str, Mapping[str, FieldOptions]] = MappingProxyType(
    {"fields": OPTIONS, "ju2008": MappingProxyType(dict.fromkeys(FEATURES, JU_2008))}
)
