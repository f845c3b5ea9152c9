"""Consent given in the form of the studio."""

from tests.serving.studio.chromium import Browser

RADIO = "[...document.querySelectorAll('.q-radio')].find((one) => one.innerText.includes('The person agreed'))"


def give_consent(browser: Browser, person: str, day: str, words: str = "") -> None:
    """Choose that a person agreed, and write who, on which day, and more words."""
    browser.wait(f"return !!{RADIO}")
    browser.run(f"{RADIO}.click()")
    browser.wait("return !!document.querySelector('input[aria-label=\"Who agreed\"]')?.offsetParent")
    browser.type("Who agreed", person)
    browser.type("On which day", day)
    if words:
        browser.type("More words, if you like", words)
