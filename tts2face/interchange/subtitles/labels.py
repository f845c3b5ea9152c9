"""Names of speakers before a colon: which of the words that stand there are names, by form, case and repetition."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from lexicon.dictionary import word_set
from lexicon.english import is_read_by_letters

# A label at the start of a line, after a dash or >>, and its manner: `- Anna (off):`, `MAN #2:`, `[JOHN]:`.
_LEAD = r"[^\S\n]*(?:(?:[-–—‐]|>{2,3}|•)[^\S\n]*)?(?:[(\[][^()\[\]\n:]{1,60}[)\]][^\S\n]+){0,2}"  # also after a noise
_LABEL = re.compile(
    r"^(?P<lead>" + _LEAD + r")(?P<label>[^\W\d_][^:：\n?!,;()\[\]]{0,40}?)[^\S\n]*"
    r"(?P<manner>[(\[][^()\[\]\n:]{1,40}[)\]][^\S\n]*)?(?::(?=\s|$)|(?<!\d)：|：(?!\d))",
    re.MULTILINE,
)
_BRACKETED = re.compile(
    r"^(?P<lead>" + _LEAD + r")[\[(](?P<label>[^\W\d_][^()\[\]\n:]{0,40})[\])][^\S\n]*:(?=\s|$)",
    re.MULTILINE,
)
# The number of one of several: MAN 2, MAN #2, EPISODE IV, SPEAKER NUMBER ONE; "NUMBER ONE" alone has no other word.
_NUMBER_WORDS = "one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve"
_ROMAN = r"(?=[IVXL])(?:XL|L?X{0,3})(?:IX|IV|V?I{0,3})"
_NUMBERED = re.compile(
    rf"(?<=\w)(?:\s*(?:#\s*|\bNo\.\s*|\b(?i:number)\s+)?\d{{1,3}}|\s+(?:(?i:number)\s+)?(?:(?i:{_NUMBER_WORDS})|{_ROMAN}))$"
)
_AFTER_SENTENCE = re.compile(r"(?P<word>\w{0,20})[.!?…。！？][\"'”’»)\]]*[^\S\n]+(?=[^\W\d_])")
_IN_BRACKETS = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")
_COUNT = re.compile(r"[(\[]\s*#?\d+\s*[)\]]\s*")
_INITIALS = re.compile(r"(?:[^\W\d_]\.)+")
_LOWER_WORD = re.compile(r"(?<![^\W\d_])[^\W\d_A-Z][^\W\d_]+")
MAX_NAME_WORDS = 5
MIN_SHARE = 0.4  # of the cues of a file that begin with a label: then also names that stand once are speakers
MIN_CUES = 3
MIN_CAPITALS = 0.5  # of the letters of a file: then capitals are how it is written, and no sign of a name
MAX_LETTERS = 200_000  # of a file that are counted for this
MAX_LABEL = 100  # characters of a label with its manner
_TITLES = word_set(
    "mr mrs ms miss dr prof sir lady lord madam mme mlle m herr frau fr hr señor señora sr sra don doña signor signora "
    "sgt lt capt col gen maj cpl pvt det insp officer detective captain sergeant lieutenant colonel general major "
    "president senator judge doctor professor father sister brother mother king queen prince princess aunt uncle rev "
    "st jr"
)
_PARTICLES = word_set("of the a an de la le du des da di del della van von der den zu y e und et and en on in at with")
# People without a name, of whom subtitles speak.
_ROLES = word_set(
    "man woman boy girl child kid baby narrator announcer speaker host reporter interviewer interviewee moderator "
    "teacher student pupil waiter waitress driver guard nurse soldier clerk crowd audience all both everyone everybody "
    "men women boys girls children kids people voice operator computer radio tv anchor presenter customer caller "
    "mann frau junge mädchen erzähler sprecher sprecherin alle beide homme femme garçon fille narrateur tous "
    "hombre mujer niño niña narrador todos uomo donna tutti mom mum dad mommy daddy grandma grandpa "
    "旁白 记者 記者 主持人 男 女 ナレーター"
)
# Words before a colon that introduce what follows; nobody has these names.
_NO_SPEAKERS = word_set(
    "note notes nb ok okay warning caution danger attention important ps pps remember reminder tip tips hint fact "
    "facts listen look see wait stop well so yes no but and or because also plus then next now today tomorrow "
    "yesterday tonight later first second third fourth fifth last finally lastly firstly secondly thirdly question "
    "questions answer answers example examples result results summary conclusion reason reasons problem problems "
    "solution solutions step steps chapter part parts scene episode act title subtitle location date time place price "
    "phone tel fax email mail address website web url source sources credits director producer starring music sound "
    "lyrics translation translator subtitles captions sync correction corrections disclaimer spoiler update breaking "
    "news alert error info information details ingredients requirements rule rules lesson section "
    "appendix figure table page version status total score name names age sex language please thanks sorry imagine "
    "think consider suppose guess message quote quotes verdict motto caption headline exit entrance open closed "
    "welcome introducing previously meanwhile therefore however otherwise namely meaning means conversely todo done "
    "pros cons goal goals task tasks day week month year level round case exhibit item point points option options "
    "words word line lines deal weather headlines forecast traffic sports live new latest exclusive developing recap "
    "volume vol book books season seasons phase phases stage stages series unit module edition issue verse chorus "
    "article amendment end up canto psalm war wars top fact-check more ahead next-up plot rumor rumour truth "
    "choice choices thing things way ways "
    "pin password username id ref re cc bcc fwd subject from to via as at by for is was are were it this that these "
    "those here there what who why how when where which i you he she we they me him her us them "
    "said says say asked told faq ad ads fun hinweis achtung warnung merke frage antwort beispiel wichtig ergebnis "
    "bemerkung notiz "
    "remarque avertissement réponse exemple nota aviso atención advertencia pregunta respuesta ejemplo "
    "importante recuerda recuerden attenzione avviso domanda risposta esempio uwaga pytanie odpowiedź pozor pozn "
    "时间 時間 地点 地點 注意 注 备注 問題 问题 答案 结果 結果 比分 例如 例"
)
# Those that introduce a sentence also before other words ("NOTE TO SELF"); "FIRST OFFICER" is a speaker.
_INTRODUCING = word_set(
    "note ps warning attention remember reminder step chapter rule fact tip breaking important caution danger hint"
)
# Names only where something else says so: days, months, acronyms, and what is counted.
_SELDOM_NAMES = word_set(
    "monday tuesday wednesday thursday friday saturday sunday january february march april may june july august "
    "september october november december number nasa nato unesco unicef covid aids fifa opec"
)
_EVERYBODY = word_set("all both everyone everybody alle beide tous todos tutti")  # "FIRST OF ALL:" is nobody
# Those that introduce one of several parts: "PART TWO OF THREE", "EPISODE IV A NEW HOPE".
_PARTS = word_set(
    "part parts episode act scene lesson season phase volume vol book day week month year chapter section series round "
    "step rule number no"
)
_BEFORE_NAMES = word_set("dear hi hello hey hallo liebe lieber cher chère chers querido querida caro cara to from re")
# "He said" in scripts without capitals, at the end or start of what stands before a colon.
_SAID_ENDINGS = ("说", "說", "道", "问", "問", "是", "为", "為", "言った", "言う", "אמר", "אמרה", "قال", "قالت", "कहा")
_SAID_STARTS = word_set("אמר אמרה قال قالت")
_NEVER_IN_NAMES = word_set(
    "i you he she we they it is are was were am be been said says say asked this that these those here there what who "
    "why how when where which not if but because my your our their his do does did have has had will would can could "
    "let's don't doesn't didn't can't won't isn't aren't wasn't i'm i've i'd i'll he's she's it's that's what's who's "
    "after before above under "
    "here's there's where's how's when's why's you're we're they're you've we've they've you'll we'll they'll"
)


@dataclass(frozen=True, slots=True)
class FoundLabel:
    """A label as it is written, its key, and whether a manner follows it: `Anna (off):`."""

    name: str
    key: str
    has_manner: bool
    has_dash: bool
    is_inner: bool = False  # it follows a sentence of somebody else


def labels_of(text: str) -> list[FoundLabel]:
    """Labels before a colon at the start of the lines of a text without tags."""
    if ":" not in text and "：" not in text:
        return []
    return [
        FoundLabel(name, label_key(name), match["manner"] is not None, match["lead"].strip()[:1] in {*"-–—‐•", ">"})
        for match in _LABEL.finditer(_BRACKETED.sub(r"\g<lead>\g<label> (as written):", text))
        if (name := " ".join(match["label"].split()))
    ]


def label_key(label: str) -> str:
    """Equal for labels of one speaker."""
    return " ".join(label.split()).casefold()


def without_manners(text: str, speakers: Collection[str]) -> str:
    """A text whose manners in brackets stand after the labels of speakers: `ANNA (off):` is `ANNA: (off)`."""
    text = _BRACKETED.sub(
        lambda match: f"{match['lead']}{match['label']}:" if label_key(match["label"]) in speakers else match[0], text
    )
    return _LABEL.sub(lambda match: _with_manner_after(match, speakers), text)


def _with_manner_after(match: "re.Match[str]", speakers: Collection[str]) -> str:
    if not match["manner"] or label_key(match["label"]) not in speakers:
        return match[0]
    # "MAN (2):" is one of two men
    manner = match["manner"].strip() if not _COUNT.fullmatch(match["manner"]) else ""
    return f"{match['lead']}{match['label']}: {manner}"


def split_label(line: str, speakers: Collection[str] | None) -> tuple[str, str] | None:
    """Speaker before the colon at the start of a line and the words after it, or None.

    Parameters
    ----------
    speakers
        Keys of the labels that are speakers; None: what has the form of a name in capitals.
    """
    match = _LABEL.match(line)
    if match is None or match["manner"]:
        return None
    label = " ".join(match["label"].split())
    is_speaker = _is_certain(label) if speakers is None else label_key(label) in speakers
    return (label, line[match.end() :]) if is_speaker else None


def divided_at_labels(text: str, speakers: Collection[str]) -> str:
    """A text with a line end before each label of a speaker that follows a sentence: `JOHN: Hi. MARY: Ho.`."""
    starts = [start for start, label in _inner_labels(text) if label.key in speakers]
    return "\n".join(text[start:end] for start, end in zip([0, *starts], [*starts, None], strict=True))


def _inner_labels(text: str) -> list[tuple[int, FoundLabel]]:
    """Labels that follow the end of a sentence within a line, with the positions at which they begin."""
    found: list[tuple[int, FoundLabel]] = []
    for match in _AFTER_SENTENCE.finditer(text) if ":" in text or "：" in text else ():
        # nobody's sentence ends in "Mr."; "Dr. Smith" is one label
        is_title = label_key(match["word"]) in _TITLES
        label = _LABEL.match(text[match.end() : match.end() + MAX_LABEL])
        if label is None or is_title:
            continue
        name = " ".join(label["label"].split())
        found.append((match.end(), FoundLabel(name, label_key(name), False, False, is_inner=True)))
    return found


def find_speakers(texts: Sequence[str]) -> Mapping[str, str]:
    """Speakers of a file by their keys, as they are written first.

    Capitals, titles (Dr. Smith), people without names (Man #2) and a manner in brackets (Anna (off)) tell a speaker;
    another name is one after a dash, if it stands twice, or if most cues begin with a label. Where most letters of the
    file are capitals, they tell nothing.

    Parameters
    ----------
    texts
        Text of each cue without tags, its lines divided by line feeds.
    """
    found = [_labels_with_inner(text) for text in texts]
    names: dict[str, str] = {}
    counts: dict[str, int] = {}
    for labels in found:
        for key in {label.key for label in labels}:
            counts[key] = counts.get(key, 0) + 1
    is_shouted = bool(counts) and _is_in_capitals(texts)
    named = {label.key for labels in found for label in labels if _is_name(label.name)}
    n_named = sum(any(label.key in named for label in labels) for labels in found)
    # in capitals a heading looks like a name: people speak again
    has_sign = not is_shouted or any(counts[key] > 1 for key in named)
    is_script = n_named >= MIN_CUES and n_named >= MIN_SHARE * len(texts) and has_sign
    in_script = {key for key in named if is_script and (" " not in key or not is_shouted)}
    small = frozenset(word for word in _LOWER_WORD.findall("\n".join(texts) if counts else "") if word != word.upper())
    for labels in found:
        is_dialogue = any(label.has_dash for label in labels)
        is_pair = is_shouted and sum(label.key in named and not label.is_inner for label in labels) > 1
        for label in labels:
            is_likely = counts[label.key] > 1 or label.key in in_script or is_pair or (is_dialogue and label.has_dash)
            is_ordinary = label.name.lower() in small
            if label.key in named and (
                label.has_manner
                or (is_likely and not is_ordinary)
                or (_is_certain(label.name, are_capitals_sure=not is_shouted) and not label.is_inner)
            ):
                names.setdefault(label.key, label.name)
    return names


def _labels_with_inner(text: str) -> list[FoundLabel]:
    """Labels of a cue, of those within lines only ones in capitals after a label at a start."""
    labels = labels_of(text)
    inner = _inner_labels(text) if labels else []
    return labels + [label for _, label in inner if label.name.lower() != label.name == label.name.upper()]


def _is_in_capitals(texts: Sequence[str]) -> bool:
    """Whether most letters are capitals, without those of labels and of what stands in brackets."""
    joined = _IN_BRACKETS.sub(" ", _LABEL.sub(" ", "\n".join(texts)[:MAX_LETTERS]))
    n_small, n_large = sum(map(str.islower, joined)), sum(map(str.isupper, joined))
    return n_large > MIN_CAPITALS * (n_small + n_large)


def _is_certain(label: str, *, are_capitals_sure: bool = True) -> bool:
    """Whether a label is a speaker wherever it stands: a name in capitals, with a title, or of a person without one."""
    if not _is_name(label):
        return False
    words = _words(_NUMBERED.sub("", label))
    if words[0] in _TITLES or words[-1] in _ROLES:
        return True
    # a single letter is a speaker only where it recurs: "A: Hello." in a course, "A:" in a list
    # nor are there capitals in scripts without them
    is_in_capitals = label.lower() != label == label.upper() and len("".join(words)) > 1
    is_seldom = words[-1] in _SELDOM_NAMES or (len(words) == 1 and _is_initialism(words[0]))
    return are_capitals_sure and is_in_capitals and not is_seldom


def _is_initialism(word: str) -> bool:
    """Whether a word is read by its letters: DNA, FBI."""
    return word.isascii() and (is_read_by_letters(word) or not set(word) & set("aeiouy"))


def _is_name(label: str) -> bool:
    """Whether a label has the form of a name: few words, each with a capital, none that introduces a sentence."""
    base = _NUMBERED.sub("", label).strip()
    written, words = base.split(), _words(base)
    if len(written) != len(words) or not 0 < len(words) <= MAX_NAME_WORDS or _introduces(written, words):
        return False
    if base.endswith(_SAID_ENDINGS) or any(character.isdigit() for character in base):
        return False
    for number, (word, key) in enumerate(zip(written, words, strict=True)):
        if "." in word and not (key in _TITLES or _INITIALS.fullmatch(word)):
            return False
        if not word[0].isupper() and (number == 0 or key not in _PARTICLES) and word[0].lower() != word[0].upper():
            return False
    return True


def _introduces(written: Sequence[str], words: Sequence[str]) -> bool:
    """Whether words before a colon introduce what follows, as ``Remember`` or ``First of all``."""
    first, last = words[0], words[-1]
    if first in _BEFORE_NAMES | _INTRODUCING | _SAID_STARTS or last in _NO_SPEAKERS or _NEVER_IN_NAMES & set(words):
        return True
    if len(words) == 1:
        return False
    is_part = first in _PARTS and _NUMBERED.search(f"a {written[1]}") is not None
    return is_part or last in _EVERYBODY or set(words) <= _PARTICLES


def _words(label: str) -> list[str]:
    return [word.casefold().replace(".", "").replace("’", "'") for word in label.split() if word.strip(".")]
