"""The report's page in a browser: it loads without a fault and without the network, and does what it says it does.

Chromium is driven through selenium; both are optional, and needed where REQUIRE_OPTIONAL is 1.
"""

import json
import os
from itertools import pairwise
from pathlib import Path
from shutil import which

import pytest
from optional import optional

from raytracer import METHODS, STAGES, backend, plain
from raytracer.report import page
from raytracer.report.figures import Contact, Figures, Sample, read_figures
from raytracer.report.gallery import draw_gallery

DOCS = Path(__file__).parent.parent / "docs"
SCENES = {
    "1_one": "# One sphere.\nsurface 1 .5 0 .2 .2 0 0 0 0 1 0\nlight 1 1 1 1 1 1\nsphere 1 0 0 -4\n",
    "2_far": "# A sphere far away.\nfov 1e-7\nsurface 1 .5 0 0 0 0 0 0 0 1 0\nlight 1 1 1 1 1 1\nsphere 1 0 0 -1e9\n",
    "3_wrong": "spere 1 0 0 -4\n",
}
DESKTOP, PHONE = (1280, 900), (360, 740)
AA = 4.5  # W3C, Web Content Accessibility Guidelines 2.2, 1.4.3; below it for small letters
CONTRASTS = """
const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
canvas.canvas.width = canvas.canvas.height = 1;
function over(under, colour) {  // what is seen of a colour that may be translucent
  canvas.globalCompositeOperation = "copy"; canvas.fillStyle = under; canvas.fillRect(0, 0, 1, 1);
  canvas.globalCompositeOperation = "source-over"; canvas.fillStyle = colour; canvas.fillRect(0, 0, 1, 1);
  const [r, g, b] = canvas.getImageData(0, 0, 1, 1).data;
  return `rgb(${r}, ${g}, ${b})`;
}
function behind(element) {
  const own = getComputedStyle(element).backgroundColor;
  return over(element.parentElement ? behind(element.parentElement) : "white", own);
}
function luminance(colour) {
  const linear = (band) => band <= .04045 ? band / 12.92 : ((band + .055) / 1.055) ** 2.4;
  const [r, g, b] = colour.match(/[0-9.]+/g).map((band) => linear(band / 255));
  return .2126 * r + .7152 * g + .0722 * b;
}
const found = [];
for (const element of document.querySelectorAll("body *")) {
  const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  if (!own || !element.checkVisibility() || element.closest("script, style, option")) continue;
  const style = getComputedStyle(element), ground = behind(element);
  const letters = over(ground, element.closest("svg") ? style.fill : style.color);
  const [light, dark] = [luminance(letters), luminance(ground)].sort((a, b) => b - a);
  found.push([(light + .05) / (dark + .05), element.textContent.trim().slice(0, 40), letters, ground]);
}
return found;
"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """A page of three scenes, one of which cannot be read, and of all charts and tables."""
    optional("jinja2")
    folder = tmp_path_factory.mktemp("report")
    for name, text in SCENES.items():
        (folder / f"{name}.cli").write_text(text)
    figures = read_figures(DOCS)
    samples = [Sample("a scene", samples, 10.0 * n, 4.0 / n) for n, samples in enumerate(("1", "4", "adaptive"), 1)]
    contacts = [Contact("self-hit", name, 10.0**k, k, 1000) for name in ("none", "bounce") for k in range(4)]
    figures = Figures(figures.scores, figures.timings, samples, contacts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(backend, "_loaded", plain)
        text = page.page("a folder", draw_gallery(folder, 16), figures, 16, (1.0, 2.0))
    out = folder / "report.html"
    out.write_text(text)
    return out.as_uri()


@pytest.fixture(scope="module")
def browser():
    optional("selenium")
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService

    programs = [
        next(filter(None, map(which, names)), None) for names in (("chromium", "google-chrome"), ("chromedriver",))
    ]
    if None in programs:
        assert os.environ.get("REQUIRE_OPTIONAL") != "1", "no chromium, or no chromedriver"
        pytest.skip("no chromium, or no chromedriver")
    options = ChromeOptions()
    options.binary_location = programs[0]
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = Chrome(options=options, service=ChromeService(programs[1]))
    yield driver
    driver.quit()


@pytest.fixture
def opened(browser, address):
    """Opens the page at a size, in light or dark; returns the browser."""

    def open_page(size=DESKTOP, dark=False):
        width, height = size
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == PHONE}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        still = {"name": "prefers-reduced-motion", "value": "reduce"}
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme, still]})
        browser.get_log("browser"), browser.get_log("performance")
        browser.get(address)
        return browser

    return open_page


def all_of(driver, selector):
    return driver.find_elements("css selector", selector)


def count(driver):
    return driver.find_element("id", "count").text


def shown(driver):
    return [tile for tile in all_of(driver, "#tiles > .tile") if tile.is_displayed()]


def choose(driver, name, value):
    from selenium.webdriver.support.ui import Select

    Select(driver.find_element("name", name)).select_by_visible_text(value)


def test_it_loads_without_a_fault_and_asks_for_nothing(opened, address):
    driver = opened()
    assert driver.get_log("browser") == []
    messages = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    assert address in asked
    assert [url for url in asked if url != address and not url.startswith("data:")] == []


def test_every_picture_says_what_it_shows_and_can_be_seen(opened):
    driver = opened()
    pictures = driver.execute_script(
        "return Promise.all([...document.querySelectorAll('.zoom img')].map(async (i) => {"
        " i.loading = 'eager'; await i.decode(); return [i.alt, i.naturalWidth, i.naturalHeight] }))"
    )
    assert len(pictures) > 2 * len(STAGES)
    for alt, width, height in pictures:
        assert (width, height) == (16, 16)
        assert alt.startswith(("One sphere. Stage ", "A sphere far away. Stage "))
    assert driver.title == "a folder: a ray-tracing report"


def test_the_filters_show_what_they_say_and_count_it(opened):
    driver = opened()
    total = len(all_of(driver, "#tiles > .tile[data-stage]"))
    assert count(driver) == f"2 of {total} pictures"  # at the stage full, by certified
    assert [tile.get_attribute("data-scene") for tile in shown(driver)] == ["1_one", "2_far", "3_wrong"]
    choose(driver, "method", "textbook")
    choose(driver, "stage", "error")
    choose(driver, "scene", "2_far")
    (tile,) = shown(driver)
    assert "textbook" in tile.get_attribute("data-methods").split()
    assert count(driver) == f"1 of {total} pictures"
    choose(driver, "stage", "all stages")
    assert {tile.get_attribute("data-stage") for tile in shown(driver)} == set(STAGES)
    driver.find_element("css selector", "#filters [type=reset]").click()
    assert count(driver) == f"{total} of {total} pictures"
    driver.find_element("name", "text").send_keys("Far AWAY depth")
    assert {(t.get_attribute("data-scene"), t.get_attribute("data-stage")) for t in shown(driver)} == {
        ("2_far", "depth")
    }
    driver.find_element("name", "text").send_keys(" nonsense")
    assert count(driver) == f"0 of {total} pictures"


def test_the_count_is_told_to_those_who_do_not_see_and_every_field_has_a_label(opened):
    driver = opened()
    assert driver.find_element("id", "count").get_attribute("aria-live") == "polite"
    fields = all_of(driver, "select, input")
    assert len(fields) == 6
    assert all(field.accessible_name for field in fields)
    assert all(button.accessible_name for button in all_of(driver, "button") if button.is_displayed())
    assert driver.find_element("css selector", "#filters fieldset legend").text


def test_a_scene_that_cannot_be_read_is_shown_with_its_message(opened):
    (fault,) = all_of(opened(), "#tiles > .fault")
    assert fault.is_displayed()
    assert "3_wrong.cli:1:1: " in fault.text
    assert "did you mean 'sphere'?" in fault.text


def test_a_picture_opens_larger_and_closes(opened):
    driver = opened()
    shown(driver)[0].find_element("css selector", ".zoom").click()
    large = driver.find_element("id", "large")
    assert large.is_displayed()
    assert large.find_element("css selector", "img").size["width"] > 300
    assert large.text.endswith("every method.") or "Stage full, drawn by certified" in large.text
    large.find_element("css selector", "button").click()
    assert not large.is_displayed()


def sentence(tip):
    name, *figures = tip.text.split("\n")
    return f"{name}: {'; '.join(figures)}"


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_mark_tells_its_figures_at_a_pointer_a_touch_and_a_key(opened, size):
    from selenium.webdriver import ActionChains, Keys
    from selenium.webdriver.common.actions.action_builder import ActionBuilder
    from selenium.webdriver.common.actions.pointer_input import PointerInput

    driver = opened(size)
    charts = [chart for chart in all_of(driver, ".chart") if chart.is_displayed()]
    assert len(charts) == 8
    tip = driver.find_element("id", "tip")
    for chart in charts:
        driver.execute_script("arguments[0].scrollIntoView({ block: 'center' })", chart)
        marks = chart.find_elements("css selector", ".mark")
        dot = marks[-1].find_element("css selector", "circle, rect, path")
        ActionChains(driver).move_to_element(dot).perform()
        assert tip.is_displayed()
        told = [mark.get_attribute("aria-label") for mark in chart.find_elements("css selector", ".mark.at")]
        assert [sentence(tip)] == told
        box, edge = tip.rect, driver.execute_script("return document.documentElement.clientWidth")
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= edge
    ActionChains(driver).send_keys(Keys.ESCAPE).perform()
    assert not tip.is_displayed()

    touch = ActionBuilder(driver, PointerInput("touch", "finger"))
    touch.pointer_action.move_to(dot).pointer_down().pointer_up()
    touch.perform()
    assert sentence(tip) == told[0]

    driver.execute_script("arguments[0].focus()", marks[0])
    assert sentence(tip) == marks[0].get_attribute("aria-label")
    ActionChains(driver).send_keys(Keys.ARROW_RIGHT).perform()
    assert sentence(tip) == marks[1].get_attribute("aria-label")
    assert driver.execute_script("return document.activeElement") == marks[1]


def test_a_chart_is_chosen_by_its_place(opened):
    from selenium.webdriver.support.ui import Select

    driver = opened()
    (card,) = (
        card for card in all_of(driver, ".card") if "Rays" in [h.text for h in card.find_elements("tag name", "h4")]
    )
    Select(card.find_element("tag name", "select")).select_by_visible_text("tangent")
    (figure,) = (figure for figure in card.find_elements("tag name", "figure") if figure.is_displayed())
    assert figure.find_element("tag name", "figcaption").text.startswith("Tangent: ")
    assert len(figure.find_elements("css selector", ".mark")) == 2 * len(METHODS)


@pytest.mark.parametrize("size", [PHONE, (768, 1024), DESKTOP, (1920, 1080)])
def test_nothing_is_wider_than_the_screen_but_tables_in_their_boxes(opened, size):
    driver = opened(size)
    driver.find_element("css selector", "#filters [type=reset]").click()
    wide, screen = driver.execute_script("const e = document.documentElement; return [e.scrollWidth, e.clientWidth]")
    assert wide == screen
    assert size[0] - 20 < screen <= size[0]  # a bar to scroll by
    if size == PHONE:
        boxes = driver.execute_script(
            "return [...document.querySelectorAll('.scroll')].map(b => b.scrollWidth > b.clientWidth)"
        )
        assert any(boxes)


@pytest.mark.parametrize("size", [PHONE, DESKTOP])
@pytest.mark.parametrize("dark", [False, True])
def test_every_word_can_be_read_in_light_and_dark(opened, size, dark):
    driver = opened(size, dark)
    contrasts = driver.execute_script(CONTRASTS)
    assert len(contrasts) > 500
    ground = driver.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, ground[4:-1].split(","))) < 200) == dark
    assert [found for found in contrasts if found[0] < AA] == []


def test_the_headings_are_an_outline(opened):
    levels = [int(heading.tag_name[1]) for heading in all_of(opened(), "h1, h2, h3, h4")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    driver = opened()
    for link in all_of(driver, "nav a"):
        assert driver.find_element("css selector", link.get_attribute("href").rpartition("#")[2].join(("#", "")))
