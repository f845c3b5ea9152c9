"""Written forms of languages with a table by kind: units with prefixes, quotations, initialisms, series, models."""

import pytest

from lexicon.locales.reading import read, read_forms
from lexicon.locales.tables import find_locale
from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce

WESTERN = ("de", "fr-fr", "es", "it", "pt-br", "pt", "nl")
UNITS = (
    *("µm", "μm", "nm", "µg", "mV", "kV", "mA", "Ω", "kΩ", "MΩ", "J", "kJ", "MJ", "Pa", "hPa", "kPa", "bar", "mbar"),
    *("mol", "mmol", "ft", "lb", "oz", "in", "yd", "mph", "°F", "dB", "Hz", "kHz", "GHz", "px", "kB", "MB", "GB", "TB"),
    *("Wh", "kWh", "MWh", "m/s", "m²", "cm³", "ha", "Mbit/s", "l/100 km", "eV", "mSv", "kN", "mAh", "Nm", "mmHg"),
)
CURRENCIES = ("€", "$", "£", "¥", "R$", "₩", "¢", "CHF", "kr", "zł", "₽", "₹", "₺", "₪", "₴", "Kč")


@pytest.mark.parametrize("language", WESTERN)
def test_units_and_currencies_are_words(language: str) -> None:
    for unit in (*UNITS, *CURRENCIES):
        for number in ("1", "2", "1,5"):
            said = spoken_form(f"{number} {unit}", language)
            assert unit in {"bar", "mol"} or unit not in said.split(), said
            assert len(said.split()) >= 2, (unit, said)
            assert not set(said) & set("Ωµμ°²³€$£¥₩¢₽₹₺₪₴"), said


@pytest.mark.parametrize(
    ("language", "unit", "forms"),
    [
        ("de", "kΩ", ("Kiloohm",)),
        ("fr", "mA", ("milliampère", "milliampères")),
        ("es", "kWh", ("kilovatio hora", "kilovatios hora")),
        ("it", "hPa", ("ettopascal",)),
        ("nl", "kΩ", ("kilo-ohm",)),  # a row of its own
    ],
)
def test_prefixes_make_units_of_their_base(language: str, unit: str, forms: tuple[str, ...]) -> None:
    locale = find_locale(language)
    assert locale is not None
    row = locale.rows("unit")[unit]
    assert row.forms == forms
    assert "alone" in row.details


@pytest.mark.parametrize(
    ("language", "text", "spoken"),
    [
        ("de", "3 MW, 3 Mio. kW", "drei Megawatt, drei Millionen Kilowatt"),
        ("pt-br", "3 MB e 3 M de euros", "três megabytes e três milhões de euros"),
        ("de", "Mit 1/2 TL Zimt, für 1/2 Stunde, aus 1/4 Liter",
         "Mit einem halben Teelöffel Zimt, für eine halbe Stunde, aus einem Viertel Liter"),
        ("de", "1 Pck. Hefe, 2 Msp. Salz, es steht 1-1",
         "ein Päckchen Hefe, zwei Messerspitzen Salz, es steht eins zu eins"),
        ("it", "È finita 2-1 dall'inizio, pepe q.b.", "È finita due a uno dall'inizio, pepe quanto basta."),
        ("pt-br", "Perdeu por 4 x 2, e Santos 1 x 0 Bahia no dia 12/05",
         "Perdeu por quatro a dois, e Santos um a zero Bahia no dia doze de maio"),
        ("pt-br", "A festa de 20/06, com 3 xíc. de leite", "A festa de vinte de junho, com três xícaras de leite"),
        ("nl", "Feyenoord won met 4-1, 250 gr. boter", "Feyenoord won met vier één, tweehonderdvijftig gram boter"),
        ("pl", "Wynik 4:1, ma 22 pkt, w temp. 5 °C",
         "Wynik cztery do jednego, ma dwadzieścia dwa punkty, w temperaturze pięć stopni Celsjusza"),
        ("ru", "1-комнатная и 3-комн. квартира, 9 тыс. руб. в мес. за 1-летний дом",
         "однокомнатная и трёхкомнатная квартира, девять тысяч рублей в месяц за однолетний дом"),
        ("nl", "Fiets, 6 jr. oud", "Fiets, zes jaar oud"),
        ("pt-br", "O apto. 7, cap. 3", "O apartamento sete, capítulo três"),
        ("ru", "в 3-е место, на 4-й неделе, на 5-й этаж, о 2-ей части",
         "в третье место, на четвёртой неделе, на пятый этаж, о второй части"),
        ("de", "3 in Berlin, 27 in.", "drei in Berlin, siebenundzwanzig Zoll."),
        ("it", "alle 5 mi alzo", "alle cinque mi alzo"),
        ("de", 'Er sagte "ich bin 27" und ging.', 'Er sagte "ich bin siebenundzwanzig" und ging.'),
        ("de", 'Ein 27" und ein 24"', "Ein siebenundzwanzig Zoll und ein vierundzwanzig Zoll"),
        ("es", "3x + 2 = 8, 3x al día", "tres x más dos es igual a ocho, tres veces al día"),
        ("fr-fr", "km56 et 10^6", "kilomètres cinquante-six et dix puissance six"),
        ("de", "1,5e-3 und 6.02E23",
         "eins Komma fünf mal zehn hoch minus drei und sechs Komma null zwei mal zehn hoch dreiundzwanzig"),
        ("de", "Das € und das ‰", "Das Euro und das Promille"),
        ("it", "1 ora, 1 zaino, 1 libro", "un' ora, uno zaino, un libro"),
        ("de", "um 1 Uhr, von 21 Uhr", "um ein Uhr, von einundzwanzig Uhr"),
    ],
)  # fmt: skip
def test_units_by_what_is_around_them(language: str, text: str, spoken: str) -> None:
    assert spoken_form(text, language) == spoken


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("am 3., 4. und 5. Mai", "am dritten, vierten und fünften Mai"),
        ("Wir kommen am 3. Dann geht es los.", "Wir kommen am dritten. Dann geht es los."),
        ("Es waren 3. Dann kam Mai.", "Es waren drei. Dann kam Mai."),
        ("Mein 2. Versuch, ihr 1. Buch", "Mein zweiter Versuch, ihr erstes Buch"),
        ("im XIX. Jahrhundert unter der Herrschaft Karls V.", "im neunzehnten Jahrhundert unter der Herrschaft "
         "Karls des fünften."),
        ("Pi ist 3.14, Python 3.14", "Pi ist drei Punkt eins vier, Python drei Punkt vierzehn"),
        ("<5, a -> 5, x>5", "kleiner als fünf, a -  fünf, x größer als fünf"),
    ],
)  # fmt: skip
def test_german_ordinals_and_signs(text: str, spoken: str) -> None:
    assert read(text, "de") == spoken


@pytest.mark.parametrize(
    ("language", "text", "spoken"),
    [
        ("de", "USB, EU und USA", "U Es Be, e u und u es a"),
        ("fr-fr", "IBM, ADN", "i bé aime, a dé enne"),
        ("es", "La OTAN, la ONU y la UNESCO", "La OTAN, la ONU y la UNESCO"),
        ("de", "ANGST, HERBST, KUNST, MARKT, OBST", "ANGST, HERBST, KUNST, MARKT, OBST"),
        ("it", "IL TRENO DI ROMA", "il TRENO di ROMA"),
        ("de", "MX5 und XC90", "emm iks fünf und iks ze neunzig"),
        ("es", "USBs", "u ese bes"),
    ],
)
def test_initialisms_are_spelled_where_letters_make_no_syllables(language: str, text: str, spoken: str) -> None:
    assert read(text, language) == spoken


def test_marks_of_trade_are_silent_and_stay_written() -> None:
    forms = read_forms("Lumo® und Lumo™ 5 km", "de")
    assert "".join(form.source for form in forms) == "Lumo® und Lumo™ 5 km"
    assert "".join(form.spoken for form in forms) == "Lumo und Lumo fünf Kilometer"


def test_words_in_other_letters_keep_their_own_sources() -> None:
    words = pronounce("Größe β und γ, 5 km", "de").words
    assert [word.source for word in words] == ["Größe", "β", "und", "γ", "5 km", "5 km"]


@pytest.mark.parametrize("language", WESTERN)
def test_paths_and_files_are_read_with_their_signs(language: str) -> None:
    locale = find_locale(language)
    assert locale is not None
    slash = locale.rows("address")["/"].spoken
    assert read("a /etc/hosts b", language) == f"a {slash} etc {slash} hosts b"
    assert read("foto.jpg", language) == f"foto {locale.rows('address')['.'].spoken} jpg"
    assert slash not in read("a / b, a/b", language)
