"""Kinds of tiers by their names: words, utterances, phones, or what is about the words."""

import re
import unicodedata
from enum import Enum, auto

# Parts of names, in lower case; of a name all its parts count ("Anna - words", "TokensAlign", "ORT-MAU").
_WORDS = re.compile(
    r"wds?|words?(?:align\w*)?|wrds?|tokens?(?:align\w*)?|tok|orts?|orth|orthograph\w*|mots?|w[oö]rter|woerter|wort|"
    r"palabras?|parole|palavras?|słow[ao]|slov[ao]|слов[ао]|woord(?:en)?|ord|sanat?|kelime(?:ler)?|szavak|λέξεις|単語|词"
)
_TEXTS = re.compile(
    r"texts?|txt|transcripts?|transcriptions?|transcri[bt]\w*|trs|tx|utt|utts|utterances?|sentences?|phrases?|"
    r"speech|speaker|spoken|said|says|dialogue?|turns?|trn|ipu\w*|lines?|äußerung(?:en)?|s[aä]tze?|énoncés?|frases?|"
    r"zdani[ae]|wypowied\w*|věty|текст\w*|предложени\w*|meningar|lauseet"
)
# of several tiers it may be the one of the translation, as "trans" may be
_LANGUAGES = re.compile(
    r"trans|english|french|german|spanish|italian|dutch|portuguese|polish|czech|russian|swedish|danish|finnish|"
    r"deutsch|français|español|italiano|nederlands|português|polski|eng|fra|deu|ger|spa|por|ita|en|fr|de|es|pt|it"
)
_PHONES = re.compile(
    r"phon\w*|phn\w*|phs?|ipa|x?sampa|arpa\w*|kan|syl\w*|sil|silences?|vowels?|consonants?|cv|features?|articul\w*|"
    r"visemes?|fon(?:em\w*|es|i)?|laute?|głosk\w*|hlásk\w*|фонем\w*|звук\w*"
)
# of words, each with a label of its own: never the words, also where the name holds them ("word tags")
_ABOUT_WORDS = re.compile(
    r"pos|lemma\w*|gloss\w*|gls|translat\w*|transl|trad|traduc\w*|traduz\w*|tradução|überset\w*|uebersetz\w*|vertaling\w*|"
    r"översätt\w*|oversett\w*|tłumacz\w*|překlad\w*|перевод\w*|çeviri|fordítás|ft|literal|lit|interlinear|igt|tags?|"
    r"types?|class(?:es)?|notes?|comments?|confidence|conf|scores?|prob\w*|tones?|tobi|breaks?|accents?|prosod\w*|stress|"
    r"morph\w*|counts?|numbers?|nr|num|segnum|ids?|index|refs?|languages?|lang|durations?|dur|freq\w*"
)
_OTHERS = re.compile(
    r"pitch|f0|momel|intsint|gestures?|gaze|hands?|head|activity\w*|noises?|events?|misc"
)  # what else is seen and heard
_WEAK = re.compile(r"seg\w*|mau|maus|labels?")  # phones, unless words are named, too: ORT-MAU
_ACTS = re.compile(r"(?:dialog(?:ue)?|speech)[\W_]*acts?(?![a-z])", re.IGNORECASE)  # of a play, an act is speech
_TOOLBOX = re.compile(r"(?:ref|id|mb|ge|gn|ps|nt|dt|cm)@")  # markers of SIL Toolbox before speakers; tx@ is the text


class NameKind(Enum):
    """Kind of the labels of a tier, as its name says."""

    WORDS = auto()
    TEXTS = auto()
    LANGUAGE = auto()
    OTHERS = auto()
    PHONES = auto()
    NOTHING = auto()


_IN_ORDER = (
    (_PHONES, NameKind.PHONES),
    (_ABOUT_WORDS, NameKind.OTHERS),
    (_WORDS, NameKind.WORDS),
    (_OTHERS, NameKind.OTHERS),
    (_WEAK, NameKind.PHONES),
    (_TEXTS, NameKind.TEXTS),
    (_LANGUAGES, NameKind.LANGUAGE),
)


def kind_of_name(name: str) -> NameKind:
    """Kind of a tier by the parts of its name; phones and what is about words outweigh the rest."""
    if _TOOLBOX.match(name) or _ACTS.search(name):
        return NameKind.OTHERS
    parts = parts_of_name(name)
    found = (kind for pattern, kind in _IN_ORDER if any(map(pattern.fullmatch, parts)))
    return next(found, NameKind.NOTHING)


def names_language(name: str) -> bool:
    """Whether a name holds one of a language, as those of translations do."""
    return any(map(_LANGUAGES.fullmatch, parts_of_name(name)))


def parts_of_name(name: str) -> list[str]:
    """Words and numbers of a name in small letters, divided also where a capital follows: ORTMau is ort and mau."""
    plain = unicodedata.normalize("NFC", name)
    divided = ""
    for at, letter in enumerate(plain):
        before, behind = plain[at - 1 : at], plain[at + 1 : at + 2]
        if letter.isupper() and (before.islower() or (before.isupper() and behind.islower())):
            divided += " "
        divided += letter
    return [part.lower() for part in re.findall(r"[^\W\d_]+|\d+", divided)]
