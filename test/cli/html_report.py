"""report.html is complete, self-contained, valid, and displayed by a browser if there is one."""

import base64
import html.parser
import re
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree

from broken_inputs import SOUND
from harness import SECONDS, Folder, Run, check, equal

GNUPLOT = shutil.which("gnuplot")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
VOID = {"meta", "img", "br"}
FULL = SOUND.replace("'stability', 'response'", "'stability', 'modes', 'response', 'forces', 'power'")
# Parts of every page with a picture of the machine.
MACHINE = ["The machine", "Natural frequencies", "Shaking forces", "Unbalance of order 1"]
FULL += "&probe name='a<b', position=0.1,0.2, limit_mm_s=5 /\n"


class Page(html.parser.HTMLParser):
    """Tags that are open, headings, texts of cells, pictures, and what the page would fetch."""

    def __init__(self, text):
        super().__init__()
        self.open, self.wrong, self.headings, self.cells, self.pictures, self.outside = [], [], [], [], [], []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("src", "href", "action", "data"):
                (self.pictures if value.startswith("data:image/svg+xml;base64,") else self.outside).append(value)
        if tag in ("script", "link", "iframe", "object"):
            self.outside.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        self.words = ""

    def handle_endtag(self, tag):
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
    """Checks that a browser without network displays all pictures of the page."""
    if not BROWSER:
        print("skip  report.html in a browser: there is no chromium")
        return
    page = path.read_text(encoding="utf-8").replace("</body>", "<script>onload=()=>{document.title='seen '+[...document.images]"
                                                    ".filter(i=>i.complete&&i.naturalWidth>99).length}</script></body>")
    with tempfile.TemporaryDirectory() as place:
        copy = path.with_name("seen.html")
        copy.write_text(page, encoding="utf-8")
        done = subprocess.run([BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                               "--disable-background-networking", "--disable-component-update", "--disable-sync",
                               f"--user-data-dir={place}", "--virtual-time-budget=5000", "--dump-dom", copy.as_uri()],
                              capture_output=True, timeout=SECONDS)
    title = re.search(r"<title>(.*?)</title>", done.stdout.decode(errors="replace"))
    equal(f"{what}: pictures in the browser", title and title[1], f"seen {pictures}")


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
            *MACHINE, "Stability", "Modes", "Vibration over a turn", "Spectrum", "Forces on the ground",
            "Forces over a turn", "Forces by orders", "Probes", "Probes over a turn", "Harmonics at the probes", "Drive", "Input",
            "Report"])
        for picture in page.pictures:
            svg = base64.b64decode(picture.partition(",")[2], validate=True)
            check("report: SVG", xml.etree.ElementTree.fromstring(svg).tag.endswith("svg"), "an SVG", svg[:40])
        equal("report: pictures", len(page.pictures), len(list((folder / "input").glob("*.svg"))))
        for cell in ("&drive", "speed_rpm", "1/min", "200", "&probe a<b", "mm/s", "re", "exponent im (rad/s)"):
            check(f"report: {cell}", cell in page.cells, "a cell of a table", sorted(set(page.cells))[:20])
        text = (folder / "input/report.html").read_text(encoding="utf-8")
        check("report: settings", "<code>drive.speed_rpm=200</code>" in text, "the setting", "none")
        check("report: verdict", '<p class="verdict stable"><strong>stable</strong>' in text, "the verdict", "none")
        shown("report", folder / "input/report.html", len(page.pictures))
        again = Run(folder, "-q", "--report", "--set", "drive.speed_rpm=200", "input.nml")
        again.done("report, quiet")
        equal("report, quiet: nothing printed", again.out, "")
        same = (folder / "input/report.html").read_text(encoding="utf-8")
        # Pictures contain no date, so gnuplot writes the same bytes.
        check("report: the same bytes", same == text, "the same", "other bytes")


def test_report_of_a_part():
    """The HTML report excludes files of other runs."""
    if not GNUPLOT:
        return
    with Folder(input=FULL) as folder:
        Run(folder, "-q", "input.nml").done("a full run")
        Run(folder, "-q", "--report", "--set", "case.tasks=stability", "input.nml").done("only stability")
        equal("only stability: parts", read(folder / "input").headings[1:], [*MACHINE, "Stability", "Input", "Report"])
    sweep = "&sweep parameter='drive.speed_rpm', from=200, to=300, count=40 /\n"
    with Folder(input=SOUND.replace("'stability', 'response'", "'sweep'") + sweep) as folder:
        Run(folder, "-q", "--report", "input.nml").done("report of a sweep")
        equal("sweep: parts", read(folder / "input").headings[1:], [*MACHINE, "Sweep", "Input", "Report"])


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
        equal("--report without gnuplot, the page", (page.headings[1:6], page.pictures), ([*MACHINE, "Stability"], []))


HTML_REPORT_TESTS = (test_report, test_report_of_a_part, test_report_refused)
