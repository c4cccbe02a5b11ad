"""report.html is complete, self-contained, valid, and displayed by a browser if there is one."""

import html
import html.parser
import json
import re
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree
from pathlib import Path

from broken_inputs import SOUND
from harness import SECONDS, SVG_ONLY, Folder, Run, check, equal

DATA = Path(__file__).resolve().parents[2] / "data"
GNUPLOT = shutil.which("gnuplot")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
VOID = {"meta", "img", "br", "input"}
FULL = SOUND.replace("'stability', 'response'", "'stability', 'modes', 'response', 'forces', 'power'")
# Parts of every page, and of every page with tables about the machine.
TOP = ["Summary", "Contents"]
MACHINE = ["The machine in motion", "The machine", "Natural frequencies", "Shaking forces", "Unbalance of order 1"]
FULL += "&probe name='a<b', position=0.1,0.2, limit_mm_s=5 /\n"
# Texts that would run a script or end an element, a comment or a CDATA section if the page did not escape them.
HOSTILE = """</script><script>alert(1)</script> ]]> &lt; &#60;b> <img src=x onerror=alert(2)> "q" --> <!--"""
HOSTILE_NAMES = "</script><svg onload=alert`3`>]]>&lt;", '"><img src=x onerror=alert`4`>'

# Shows the page in frames of several widths, light and dark, and writes what it finds into the title of the document.
LOOK = """<!DOCTYPE html><meta charset="utf-8"><title>none</title><script>
const page = %s, found = {};
function look(frame, view, dark) {
  const d = frame.contentDocument, w = frame.contentWindow, all = [...d.querySelectorAll('*')];
  const brightness = colour => colour.match(/[0-9.]+/g).slice(0, 3).reduce((a, b) => a + +b, 0) / 3;
  const opaque = e => (s => s.fill.startsWith('rgb(') && +s.fillOpacity === 1)(w.getComputedStyle(e));
  const area = e => (r => r.width * r.height)(e.getBoundingClientRect());
  const keys = [...d.querySelectorAll('a,button,summary,input,.wide')].filter(e => e.getClientRects().length);
  const buttons = [...d.querySelectorAll('button.all')].filter(e => e.getClientRects().length);
  found[view] = {
    overflow: d.documentElement.scrollWidth - d.documentElement.clientWidth,
    pictures: [...d.querySelectorAll('svg.plot')].filter(e => e.getBoundingClientRect().width > 99).length,
    foreign: all.filter(e => [...e.attributes].some(a => a.name.startsWith('on')) || /^(IMG|IFRAME|LINK|OBJECT|EMBED|BASE)$/
      .test(e.tagName) || e.tagName === 'SCRIPT' && e.src).map(e => e.outerHTML),
    requests: w.performance.getEntriesByType('resource').map(e => e.name).filter(name => !name.startsWith('data:')),
    scripts: d.scripts.length,
    repeated: all.map(e => e.id).filter((id, i, ids) => id && ids.indexOf(id) < i),
    dangling: all.map(e => e.getAttribute('href')).filter(h => h && h[0] === '#' && !d.getElementById(h.slice(1))),
    unreachable: keys.filter(e => (e.focus(), d.activeElement !== e)).map(e => e.outerHTML.slice(0, 99)),
    scrolls: all.filter(e => e.scrollWidth > e.clientWidth + 1 && /auto|scroll/.test(w.getComputedStyle(e).overflowX)
      && e.tabIndex < 0 && e !== d.documentElement).map(e => e.outerHTML.slice(0, 99)),
    slabs: [...d.querySelectorAll('rect,polygon,path')].filter(e => opaque(e) && area(e) > 5000
      && (l => dark ? l > 200 : l < 40)(brightness(w.getComputedStyle(e).fill))).map(e => e.outerHTML.slice(0, 99)),
    bright: brightness(w.getComputedStyle(d.body).backgroundColor) > 128,
    small: [...d.querySelectorAll('.plot text')].map(e => e.getBoundingClientRect().height).filter(h => h > 0 && h < 7).length,
    cut: (d.activeElement.blur(), [...d.querySelectorAll('.plot')].filter(e => parseFloat(e.style.getPropertyValue('--w')) <= 640
      && e.getBoundingClientRect().width > w.innerWidth - 31).map(e => e.id || e.outerHTML.slice(0, 99))),
    enlarged: [...d.querySelectorAll('.plot')].slice(0, 1).map(e => (e.parentElement.focus(), e.getBoundingClientRect().width > 600)),
    viewers: [...d.querySelectorAll('.viewer')].filter(v => {
      const find = name => v.querySelector('.' + name), state = () => find('views').innerHTML;
      const set = (name, value) => (find(name).value = value, find(name).dispatchEvent(new w.Event('input')), state());
      const words = find('play').textContent;
      find('play').click();
      const toggled = find('play').textContent !== words;
      return !(toggled && set('angle', 0) !== set('angle', 5) && set('zoom', 0) !== set('zoom', 3)
        && find('play').textContent === 'Play' && v.querySelector('svg').getBoundingClientRect().width > 99);
    }).length,
    buttons: buttons.filter(b => {
      const hidden = () => [...b.nextElementSibling.querySelectorAll('.x')].filter(e => !e.getClientRects().length).length;
      const before = hidden();
      b.click();
      const pressed = b.getAttribute('aria-pressed') === 'true' && hidden() === 0;
      b.click();
      return before === 0 || !pressed || hidden() !== before;
    }).length,
  };
}
const views = [[390, false], [390, true], [1280, false]];
let left = views.length;
for (const [width, dark] of views) {
  const frame = document.createElement('iframe');
  frame.style = `width:${width}px;height:800px;border:0;color-scheme:${dark ? 'dark' : 'light'}`;
  frame.srcdoc = page;
  frame.onload = () => {
    look(frame, width + (dark ? ' dark' : ' light'), dark);
    if (--left === 0) document.title = JSON.stringify(found);
  };
  document.documentElement.append(frame);
}
</script>
"""


class Page(html.parser.HTMLParser):
    """Tags that are open, headings, texts of cells, number of pictures, and what the page would fetch."""

    def __init__(self, text):
        super().__init__()
        self.open, self.wrong, self.headings, self.cells, self.outside = [], [], [], [], []
        self.pictures = 0
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("src", "href", "action", "data") and not value.startswith(("#", "data:image/png;base64,")):
                self.outside.append(value)
        self.pictures += ("class", "plot") in attributes
        if tag in ("link", "iframe", "object"):
            self.outside.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        self.words = ""

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)
        if tag in ("h1", "h2"):
            self.headings.append(self.words)
        if tag in ("td", "th"):
            self.cells.append(self.words)
        self.words = ""

    def handle_data(self, data):
        self.words += data


def read(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def shown(what, path, pictures):
    """Checks the page in a browser: narrow and wide, light and dark, by keyboard and without network."""
    if not BROWSER:
        print("skip  report.html in a browser: there is no chromium")
        return
    page = json.dumps(path.read_text(encoding="utf-8")).replace("<", "\\u003c")
    with tempfile.TemporaryDirectory() as place:
        copy = path.with_name("look.html")
        copy.write_text(LOOK % page, encoding="utf-8")
        done = subprocess.run([BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                               "--disable-background-networking", "--disable-component-update", "--disable-sync",
                               "--window-size=1400,900", f"--user-data-dir={place}", "--virtual-time-budget=9000", "--dump-dom",
                               copy.as_uri()], capture_output=True, timeout=SECONDS)
    title = re.search(r"<title>(.*?)</title>", done.stdout.decode(errors="replace"))
    found = html.unescape(title[1]) if title else "none"
    check(f"{what}: seen in the browser", found.startswith("{"), "findings", found)
    for view, finds in (json.loads(found) if found.startswith("{") else {}).items():
        wanted = {"overflow": 0, "pictures": pictures, "foreign": [], "requests": [], "repeated": [], "dangling": [],
                  "unreachable": [], "scrolls": [], "slabs": [], "bright": view.endswith("light"), "small": 0, "cut": [],
                  "enlarged": [True], "buttons": 0, "viewers": 0}
        equal(f"{what}: browser, {view}", {key: finds[key] for key in wanted}, wanted)
        equal(f"{what}: browser, {view}, scripts", finds["scripts"], path.read_text(encoding="utf-8").count("<script"))


def test_report():
    """The HTML report is complete, self-contained and valid."""
    if not GNUPLOT:
        print("skip  report.html: there is no gnuplot")
        return
    with Folder(input=FULL.replace("title = '", "title = 'A & <B> \"C\" ")) as folder:
        run = Run(folder, "--report", "--set", "drive.speed_rpm=200", "input.nml")
        if not run.done("report"):
            return
        page = read(folder / "input")
        equal("report: tags", (page.open, page.wrong), ([], []))
        equal("report: no external references", page.outside, [])
        check("report: title", page.headings[0].startswith('A & <B> "C" '), "the input's title", page.headings[0])
        equal("report: parts", page.headings[1:], [
            *TOP, *MACHINE, "Stability", "Modes", "Vibration over a turn", "Spectrum", "Forces on the ground",
            "Forces over a turn", "Forces by orders", "Probes", "Probes over a turn", "Harmonics at the probes", "Drive", "Input",
            "Report"])
        text = (folder / "input/report.html").read_text(encoding="utf-8")
        for picture in re.findall(r'<svg class="plot".*?</svg>', text, re.S):
            check("report: SVG", xml.etree.ElementTree.fromstring(picture).get("role") == "img", "a picture", picture[:40])
        equal("report: pictures", page.pictures, len([one for one in (folder / "input").glob("*.svg") if "motion" not in one.name]))
        for cell in ("&drive", "speed_rpm", "rpm", "200", "&probe a<b", "mm/s", "re", "exponent im (rad/s)", "near order 6",
                     "damping ratio (%)", "frequency / crank frequency", "angle (deg)"):
            check(f"report: {cell}", cell in page.cells, "a cell of a table", sorted(set(page.cells))[:20])
        check("report: probe", "<dt>probe closest to its limit</dt>" in text, "a limit is given", "another word")
        check("report: rounding errors are shown as 0", not re.search(r">-?[\d.]+e-[23]\d<", text), "0", re.findall(
            r">-?[\d.]+e-[23]\d<", text))
        check("report: settings", "<code>drive.speed_rpm=200</code>" in text, "the setting", "none")
        check("report: verdict", '<p class="verdict stable"><strong>stable</strong>' in text, "the verdict", "none")
        check("report: file names as captions", not re.search(r"<caption>\w+\.csv", text), "none", "a file name")
        check("report: policy", "default-src 'none'" in text, "the page loads nothing", text[:600])
        shown("report", folder / "input/report.html", page.pictures)
        again = Run(folder, "-q", "--report", "--set", "drive.speed_rpm=200", "input.nml", environment=SVG_ONLY)
        again.done("report, quiet")
        equal("report, quiet: nothing printed", again.out, "")
        same = (folder / "input/report.html").read_text(encoding="utf-8")
        # Pictures contain no date, so gnuplot writes the same bytes.
        check("report: the same bytes", same == text, "the same", "other bytes")


def test_units():
    """A table on the page shows all forces in one unit, that of the largest."""
    with Folder(input=(DATA / "engine_four_stroke.nml").read_text()) as folder:
        if Run(folder, "-q", "--report", "-s", "case.tasks='joints'", "input.nml", environment=SVG_ONLY).done("units"):
            text = (folder / "input/report.html").read_text(encoding="utf-8")
            for table in re.findall(r"<table>.*?</table>", text, re.S):
                units = re.findall(r"<th[^>]*>f\w* [^<]*\((k?N)\)", table)
                check("units: forces of a table", len(set(units)) < 2, "one unit", units)
            check("units: table of joint forces", re.search(r"f peak \(kN\).*f rms \(kN\)", text, re.S), "kN", "none")


def test_hostile_report():
    """Titles and names cannot add elements or scripts to the HTML report."""
    if not GNUPLOT:
        return
    probes = "".join(f"&probe name='{name}', position=0.1,0.1, limit_mm_s=5 /\n" for name in HOSTILE_NAMES)
    with Folder(input=FULL.replace("title = '", f"title = '{HOSTILE}") + probes) as folder:
        if not Run(folder, "-q", "--report", "input.nml", environment=SVG_ONLY).done("hostile names"):
            return
        page = read(folder / "input")
        equal("hostile names: tags", (page.open, page.wrong, page.outside), ([], [], []))
        check("hostile names: title", page.headings[0].startswith(HOSTILE), HOSTILE, page.headings[0])
        for name in HOSTILE_NAMES:
            check(f"hostile names: {name}", name in page.cells, "a cell", sorted(set(page.cells))[:20])
        shown("hostile names", folder / "input/report.html", page.pictures)


def test_size_of_report():
    """The HTML report of the paper's machine has at most 300 kB."""
    if not GNUPLOT:
        return
    with Folder() as folder:
        Run(folder, "-q", "--report", "-o", "out", DATA / "khang_four_bar.nml").done("the paper's machine")
        size = (folder / "out/report.html").stat().st_size
        check("size of the page", size <= 300_000, "at most 300000 bytes", size)


def test_report_of_a_part():
    """The HTML report excludes files of other runs."""
    if not GNUPLOT:
        return
    with Folder(input=FULL) as folder:
        Run(folder, "-q", "input.nml").done("a full run")
        Run(folder, "-q", "--report", "--set", "case.tasks=stability", "input.nml", environment=SVG_ONLY).done("only stability")
        equal("only stability: parts", read(folder / "input").headings[1:],
              [*TOP, *MACHINE, "Stability", "Input", "Report"])
    sweep = "&sweep parameter='drive.speed_rpm', from=200, to=300, count=40 /\n"
    with Folder(input=SOUND.replace("'stability', 'response'", "'sweep'") + sweep) as folder:
        Run(folder, "-q", "--report", "input.nml", environment=SVG_ONLY).done("report of a sweep")
        equal("sweep: parts", read(folder / "input").headings[1:], [*TOP, *MACHINE, "Sweep", "Input", "Report"])


def test_report_refused():
    """--report without gnuplot or with conflicting options is refused."""
    for other in ("--check", "--one-line", "--part=1/2"):
        with Folder() as folder:
            Run(folder, "--report", other, "input.nml").refused(f"--report {other}", 1,
                                                                 re.compile(".*exclude each other"))
    with Folder() as folder:
        run = Run(folder, "--report", "input.nml", environment={"PATH": ""})
        equal("--report without gnuplot", (run.code, run.err.count("\n"), "gnuplot-nox" in run.err), (4, 1, True))
        page = read(folder / "input")
        equal("--report without gnuplot, the page", (page.headings[1:], page.pictures),
              ([*TOP, MACHINE[0], *MACHINE[2:], "Stability", "Input", "Report"], 0))


HTML_REPORT_TESTS = (test_report, test_units, test_hostile_report, test_size_of_report, test_report_of_a_part, test_report_refused)
