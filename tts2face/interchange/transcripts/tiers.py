"""Choice of the tier that holds the spoken words: by name, then by content."""

import re
import statistics
from collections.abc import Sequence

from lexicon.dictionary import cmudict_lookup
from lexicon.errors import InputError
from lexicon.phones import PHONES
from tts2face.interchange.transcripts.silence import is_silence, spoken_part
from tts2face.interchange.transcripts.spoken import Tier

# Parts of names, in lower case; of a name all its words count ("Anna - words", "TokensAlign", "ORT-MAU").
WORDS = re.compile(
    r"wds?|words?(?:align\w*)?|wrds?|tokens?(?:align\w*)?|tok|orts?|orth|orthograph\w*|mots?|w[oö]rter|wort|palabras?|parole|palavras?|slova|woord(?:en)?"
)
TEXTS = re.compile(
    r"texts?|txt|transcripts?|transcriptions?|transcri[bt]\w*|trans|trs|tx|utt|utts|utterances?|sentences?|phrases?|"
    r"speech|speaker|spoken|said|says|dialogue?|turns?|trn|ipu\w*|lines?|english|french|german|spanish|italian|dutch|"
    r"portuguese|polish|czech|russian|swedish|danish|finnish|deutsch|français|español|italiano|nederlands"
)
# Phones, and what is about the words: never chosen for their names, nor for their content where words are
PHONES_BY_NAME = re.compile(
    r"phon\w*|phn\w*|phs?|ipa|x?sampa|arpa\w*|kan|syl\w*|sil|silences?|vowels?|consonants?|cv|features?|articul\w*|visemes?"
)
OTHERS_BY_NAME = re.compile(
    r"pos|lemma\w*|gloss\w*|translat\w*|tags?|notes?|comments?|confidence|tones?|tobi|breaks?|pitch|f0|momel|intsint|"
    r"gestures?|gaze|hands?|head|activity\w*|noises?|events?|misc|break|accents?|prosod\w*|stress|morph\w*|ft"
)
WEAK_BY_NAME = re.compile(r"seg\w*|mau|maus|labels?")  # phones, unless words are named, too: ORT-MAU
_PART = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-zà-ÿ]+|\d+")
MAX_PHONE_LETTERS = 2  # median of labels, without digits of stress and marks of length
MAX_PHONE_S = 0.15  # median of phones; words last .2 to .4 s, letters that are spelt .3 s
LEAST_KNOWN = 0.5  # of the words, in the dictionary
SURELY_KNOWN = 0.8  # short words, such as "I am on it", and no phones
_PUNCTUATION = ".,;:!?\"'()"
_WORDS_OF_ONE_LETTER = frozenset("aAI")
_MARKS = re.compile(r"[0-9ːˑˈˌ:~^_\"'`\\\u0300-\u036f]")

RANK_WORDS, RANK_TEXTS, RANK_KNOWN, RANK_UNKNOWN, RANK_POINTS, RANK_OTHERS, RANK_PHONES = range(7)
SOUNDS = frozenset({"silent", "sounding"})  # "To TextGrid (silences)" of Praat


def choose_tier(path: str, tiers: Sequence[Tier], name: str | None = None) -> tuple[Tier | None, str]:
    """The tier of the spoken words, None without one, and a sentence about the choice, empty if there was none.

    Parameters
    ----------
    path
        Name of the file in sentences.
    name
        Name of the tier, where it is given.
    """
    if name is not None:
        found = [tier for tier in tiers if tier.name.casefold() == name.strip().casefold()]
        if not found:
            raise InputError(f"{path} has no tier {name!r}; it has {name_tiers(tiers)}")
        return next((tier for tier in found if _has_words(tier)), found[0]), ""
    full = [tier for tier in tiers if _has_words(tier)]
    ranked = sorted(full, key=tier_rank)  # stable: of equals the first
    usable = [tier for tier in ranked if tier_rank(tier) < RANK_OTHERS]
    if not usable:
        return None, ""
    best = tier_rank(usable[0])
    equals = [tier for tier in usable if tier_rank(tier) == best]
    chosen = equals[0] if best < RANK_KNOWN else _with_long_labels(equals)
    if len(tiers) == 1:
        return chosen, ""
    others = [tier for tier in equals if tier is not chosen]
    more = f"; {name_tiers(others)} also has words" if len(others) == 1 else ""
    more = f"; {name_tiers(others)} also have words" if len(others) > 1 else more
    return chosen, f"the words of {path} are those of its tier {chosen.name!r}{more}; --tier names another"


def _has_words(tier: Tier) -> bool:
    return any(spoken_part(label.text) for label in tier.labels)


def name_tiers(tiers: Sequence[Tier]) -> str:
    """Names of tiers in a sentence."""
    names = [repr(tier.name) for tier in tiers]
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part) if names else "none"


def tier_rank(tier: Tier) -> int:
    """How probably a tier holds the spoken words; the lowest is best."""
    if tier.is_speech:
        return RANK_WORDS
    by_name = _rank_of_name(tier.name)
    by_name = _rank_of_name(tier.kind) if by_name is None else by_name
    if by_name == RANK_PHONES or has_phones(tier) or SOUNDS.issuperset(label.text for label in tier.labels):
        return RANK_PHONES
    if by_name is not None:
        return by_name
    if tier.has_points:
        return RANK_POINTS
    return RANK_KNOWN if _share_known(tier) >= LEAST_KNOWN else RANK_UNKNOWN


def _rank_of_name(name: str) -> int | None:
    """Rank of a tier by the words of its name; None for a name that says nothing."""
    parts = [part.lower() for part in _PART.findall(name)]

    def is_named(kind: re.Pattern[str]) -> bool:
        return any(kind.fullmatch(part) for part in parts)

    if is_named(PHONES_BY_NAME):
        return RANK_PHONES
    if is_named(WORDS):
        return RANK_WORDS
    if is_named(OTHERS_BY_NAME):
        return RANK_OTHERS
    if is_named(WEAK_BY_NAME):
        return RANK_PHONES
    return RANK_TEXTS if is_named(TEXTS) else None


def has_phones(tier: Tier) -> bool:
    """Whether most labels are symbols of phones: short ones that last as long as phones, or those of IPA."""
    labels = [label for label in tier.labels if not is_silence(label.text)]
    if not labels:
        return False
    plain = [_MARKS.sub("", label.text) for label in labels]
    n_ipa = sum(not text.isascii() and text in PHONES for text in plain)
    if n_ipa > len(plain) / 10 and statistics.median(map(len, plain)) <= MAX_PHONE_LETTERS:
        return True
    if _share_known(tier) >= SURELY_KNOWN:
        return False
    durations = [label.end - label.start for label in labels if label.end > label.start]
    return (
        statistics.median(map(len, plain)) <= MAX_PHONE_LETTERS
        and max(map(len, plain)) <= MAX_PHONE_LETTERS + 2
        and bool(durations)
        and statistics.median(durations) <= MAX_PHONE_S
    )


def _share_known(tier: Tier) -> float:
    """Share of the words that are in the English dictionary."""
    words = [word.strip(_PUNCTUATION) for label in tier.labels for word in spoken_part(label.text).split()]
    # the dictionary holds all letters
    known = [
        (len(word) > 1 or word in _WORDS_OF_ONE_LETTER) and cmudict_lookup(word.lower()) is not None for word in words
    ]
    return sum(known) / max(len(known), 1)


def _with_long_labels(tiers: Sequence[Tier]) -> Tier:
    """The first tier whose labels are at least half as long as the longest ones of a tier."""
    lengths = [
        statistics.fmean(len(text) for label in tier.labels if (text := spoken_part(label.text))) for tier in tiers
    ]
    return next(tier for tier, length in zip(tiers, lengths, strict=True) if length >= max(lengths) / 2)
