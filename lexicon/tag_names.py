"""Names of tags between < and > in the texts of people and models, and what each is; marks of other markups."""

from collections.abc import Mapping
from types import MappingProxyType

from lexicon.dictionary import word_set
from lexicon.markdown import PARAGRAPH_END, SENTENCE_END

# Tags of HTML and SSML whose content is spoken; those of the last two lines wrap what models say.
BREAKS: Mapping[str, str] = MappingProxyType({
    **dict.fromkeys(("br", "li", "tr", "s", "sentence", "dt", "dd"), SENTENCE_END),
    **dict.fromkeys(
        ("p", "div", "ul", "ol", "table", "h1", "h2", "h3", "h4", "h5", "h6", "blockquote", "hr", "paragraph"),
        PARAGRAPH_END,
    ),
})  # fmt: skip
PASSED = word_set(
    "b i u s em strong small big sub sup mark del ins span font a abbr cite code pre kbd samp var q html body head "
    "title section article header footer main nav img th td tbody thead details summary center strike tt label w token "
    "speak voice lang audio phoneme say-as prosody emphasis express-as bookmark desc meta metadata lexicon lookup "
    "answer response output final result message speech say text reply assistant user system content dialogue dialog "
    "script narration url color quote "
)
UNFOLLOWED = frozenset(["voice", "lang", "audio", "phoneme", "say-as", "prosody"])
MOOD_TAGS = word_set("emotion mood expression style tone feeling gesture action express-as")
PAUSE_TAGS: Mapping[str, float] = MappingProxyType({"break": 0.4, "pause": 0.7, "silence": 0.7})
# Marks of SSML in square brackets, and of bulletin boards; a level of emphasis stands behind a space.
FOREIGN_MARK = (
    r"\[(?:/(?P<ended>[A-Za-z][\w-]{0,30})|(?:emphasis|prosody)(?:\s(?:strong|moderate|none|reduced))?"
    r"|(?:emphasis|prosody|say-as|lang|express-as|url|color|font|quote)[:=]\S[^\[\]\n]{0,80})\]"
    r"|\[(?P<board>[bius])\](?=[^\[\n]{1,200}\[/(?P=board)\])"
)
