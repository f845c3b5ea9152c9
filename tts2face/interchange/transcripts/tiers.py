"""Choice of the tier that holds the spoken words: by name, by what belongs to what, then by content."""

import re
import statistics
from collections.abc import Sequence

from lexicon.dictionary import cmudict_lookup
from lexicon.errors import InputError
from lexicon.phones import PHONES
from tts2face.interchange.transcripts.silence import is_silence, spoken_part
from tts2face.interchange.transcripts.spoken import Tier
from tts2face.interchange.transcripts.tier_names import NameKind, kind_of_name, names_language, parts_of_name

MAX_PHONE_LETTERS = 2  # median of labels, without digits of stress and marks of length
MAX_PHONE_S = 0.15  # median of phones; words last .2 to .4 s, letters that are spelt .3 s
LEAST_KNOWN = 0.5  # of the words, in the dictionary
SURELY_KNOWN = 0.8  # short words, such as "I am on it", and no phones
LEAST_PLAIN = 0.8  # of the words of a language, in small letters behind the first, without digits
LEAST_NUMBERED = 0.8  # of labels that number others: ann.012, u7
MAX_NAMED = 6  # tiers in a note
SOUNDS = frozenset({"silent", "sounding"})  # "To TextGrid (silences)" of Praat
_PUNCTUATION = ".,;:!?\"'()"
_WORDS_OF_ONE_LETTER = frozenset("aAI")
_MARKS = re.compile(r"[0-9ːˑˈˌ:~^_\"'`\\\u0300-\u036f]")
_NUMBERED = re.compile(r"(?=\S*\d)(?:[^\W\d_]{1,12}[\W_]*\d\S*|\d+[.:_-]\d\S*)")

RANK_WORDS, RANK_TEXTS, RANK_KNOWN, RANK_UNKNOWN, RANK_DEPENDENT, RANK_POINTS, RANK_OTHERS, RANK_PHONES = range(8)


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
        return next((tier for tier in found if has_words(tier)), found[0]), ""
    full = [tier for tier in tiers if has_words(tier)]
    ranks = _ranks(full, tiers)
    # stable: of equals the first
    usable = sorted((rank, at) for at, rank in enumerate(ranks) if rank < RANK_OTHERS)
    if not usable:
        return None, ""
    best = usable[0][0]
    equals = [full[at] for rank, at in usable if rank == best]
    chosen = equals[0] if best < RANK_KNOWN else _with_long_labels(equals)
    if len(tiers) == 1:
        return chosen, ""
    others = [full[at] for _, at in usable if full[at] is not chosen]
    rest = [tier for tier, rank in zip(full, ranks, strict=True) if rank >= RANK_OTHERS]
    also = f"; {name_tiers(others)} also {'has' if len(others) == 1 else 'have'} words" if others else ""
    kinds = f"; {name_tiers(rest)} {'is' if len(rest) == 1 else 'are'} taken for phones or notes" if rest else ""
    return chosen, f"the words of {path} are those of its tier {chosen.name!r}{also}{kinds}; --tier names another"


def has_words(tier: Tier) -> bool:
    """Whether a label of a tier is more than silence."""
    return any(spoken_part(label.text) for label in tier.labels)


def name_tiers(tiers: Sequence[Tier]) -> str:
    """Names of tiers in a sentence."""
    names = [repr(tier.name) for tier in tiers[:MAX_NAMED]]
    names += [f"{len(tiers) - MAX_NAMED} more"] if len(tiers) > MAX_NAMED else []
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part) if names else "none"


def _ranks(full: Sequence[Tier], tiers: Sequence[Tier]) -> list[int]:
    """How probably each tier holds the spoken words, the lowest best: parents before what belongs to them."""
    ranks = [_rank(tier) for tier in full]
    parents = {tier.name: tier.parent or _parent_by_name(tier, full) for tier in tiers}
    speech = {tier.name for tier, rank in zip(full, ranks, strict=True) if rank < RANK_POINTS}
    for at, (tier, rank) in enumerate(zip(full, ranks, strict=True)):
        may_depend = RANK_TEXTS < rank < RANK_POINTS or (rank == RANK_TEXTS and names_language(tier.name))
        if may_depend and _ancestors(tier.name, parents) & speech:
            ranks[at] = RANK_DEPENDENT
    return ranks


def _parent_by_name(tier: Tier, tiers: Sequence[Tier]) -> str:
    """Name of a tier to whose name this one adds words: Anna-en to Anna; empty without one."""
    own = parts_of_name(tier.name)
    for other in tiers:
        parts = parts_of_name(other.name)
        added = own[len(parts) :]
        if parts and own[: len(parts)] == parts and added and not any(part.isdigit() for part in added):
            return other.name
    return ""


def _ancestors(name: str, parents: dict[str, str]) -> set[str]:
    found: set[str] = set()
    while (name := parents.get(name, "")) and name not in found:
        found.add(name)
    return found


def _rank(tier: Tier) -> int:
    """Rank of a tier by its name and content alone."""
    if tier.is_speech:
        return RANK_WORDS
    named = kind_of_name(tier.name)
    if named in {NameKind.NOTHING, NameKind.LANGUAGE}:
        named = kind_of_name(tier.kind)
    if named is NameKind.PHONES or has_phones(tier) or SOUNDS.issuperset(label.text for label in tier.labels):
        return RANK_PHONES
    if named is NameKind.OTHERS or _numbers_others(tier):
        return RANK_OTHERS
    if named in {NameKind.WORDS, NameKind.TEXTS}:
        return RANK_WORDS if named is NameKind.WORDS else RANK_TEXTS
    if tier.has_points:
        return RANK_POINTS
    return RANK_KNOWN if _is_english(tier) or _is_prose(tier) else RANK_UNKNOWN


def has_phones(tier: Tier) -> bool:
    """Whether most labels are symbols of phones: short ones that last as long as phones, or those of IPA."""
    labels = [label for label in tier.labels if not is_silence(label.text)]
    if not labels:
        return False
    plain = [_MARKS.sub("", label.text) for label in labels]
    n_ipa = sum(not text.isascii() and text in PHONES for text in plain)
    if n_ipa > len(plain) / 10 and statistics.median(map(len, plain)) <= MAX_PHONE_LETTERS:
        return True
    durations = [label.end - label.start for label in labels if label.end > label.start]
    return (
        statistics.median(map(len, plain)) <= MAX_PHONE_LETTERS
        and max(map(len, plain)) <= MAX_PHONE_LETTERS + 2
        and bool(durations)
        and statistics.median(durations) <= MAX_PHONE_S
        and _share_known(tier) < SURELY_KNOWN
    )


def _numbers_others(tier: Tier) -> bool:
    """Whether labels are numbers of utterances, as the uppermost tiers of field work: ann.012."""
    texts = [text for label in tier.labels if (text := spoken_part(label.text))]
    return sum(_NUMBERED.fullmatch(text) is not None for text in texts) >= LEAST_NUMBERED * len(texts)


def _share_known(tier: Tier) -> float:
    """Share of the words that are in the English dictionary."""
    words = [word.strip(_PUNCTUATION) for label in tier.labels for word in spoken_part(label.text).split()]
    # the dictionary holds all letters
    known = [
        (len(word) > 1 or word in _WORDS_OF_ONE_LETTER) and cmudict_lookup(word.lower()) is not None for word in words
    ]
    return sum(known) / max(len(known), 1)


def _is_english(tier: Tier) -> bool:
    return _share_known(tier) >= LEAST_KNOWN


def _is_prose(tier: Tier) -> bool:
    """Whether labels are words of any language, and no codes: small letters, and few labels that recur."""
    texts = [text for label in tier.labels if (text := spoken_part(label.text))]
    words = [plain for text in texts for word in text.split() if (plain := word.strip(_PUNCTUATION))]
    plain_words = [word for word in words if word[1:] == word[1:].lower() and not any(map(str.isdigit, word))]
    if not words or len(plain_words) < LEAST_PLAIN * len(words):
        return False
    # words of one character are those of Chinese
    is_long = statistics.median(map(len, words)) > MAX_PHONE_LETTERS or not "".join(words).isascii()
    return is_long and (len(words) >= 2 * len(texts) or len(set(texts)) >= len(texts) / 2)


def _with_long_labels(tiers: Sequence[Tier]) -> Tier:
    """The first tier whose labels are at least half as long as the longest ones of a tier of its language."""
    is_english = _is_english(tiers[0])
    alike = [tier for tier in tiers if _is_english(tier) == is_english]
    lengths = [
        statistics.fmean(len(text) for label in tier.labels if (text := spoken_part(label.text))) for tier in alike
    ]
    return next(tier for tier, length in zip(alike, lengths, strict=True) if length >= max(lengths) / 2)
