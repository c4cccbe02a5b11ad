"""The live page: its server with good and hostile requests, and the page in a browser if there is one.

    python3 bindings/live.py PROGRAM

The last line is "N passed, M failed".
"""
import concurrent.futures
import html
import http.client
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import gestell
from gestell import live
from gestell._live_solver import Solver

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "data/khang_four_bar.nml"
TEXT = FILE.read_text()
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
HOSTILE = """</script><script>document.title='taken'</script> <img src=x onerror="document.title='taken'"> ]]> <!--"""
passed = failed = 0


def check(name, holds, found=""):
    """Counts a condition; shows what was found if it does not hold."""
    global passed, failed
    passed, failed = passed + bool(holds), failed + (not holds)
    if not holds:
        print(f"FAIL  {name}: {str(found)[:600]}")


class Client:
    """A browser that asks a server."""

    def __init__(self, server, name="test"):
        self.server, self.name, self.number = server, name, 0

    def ask(self, method, path, body=None, **headers):
        """Status, headers and body of the answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.server.server_port, timeout=120)
        try:
            connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read().decode()
        finally:
            connection.close()

    def solve(self, text=TEXT, changes=(), number=None):
        self.number += 1
        request = {"client": self.name, "number": number or self.number, "text": text, "changes": [*changes]}
        status, _, body = self.ask("POST", "/solve", json.dumps(request), Content_Type="application/json")
        return json.loads(body) if status == 200 else {"status": status}


def serve(file=FILE, kind=live.Server):
    server = kind(file, 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def close(server):
    server.shutdown()
    server.server_close()


def one_line(program, file, *options):
    """What the program prints about a file, the values of the options left out."""
    run = subprocess.run([program, "--one-line", *options, file], capture_output=True, text=True, check=False)
    return [line.split(",")[len(options) // 2:] for line in run.stdout.splitlines()]


def verdict_of(page):
    return re.search(r'<p class="verdict (\w+)"', page)[1]


def answers(program):
    """The page and its answers."""
    server = serve()
    client = Client(server)
    status, headers, page = client.ask("GET", "/")
    check("page", status == 200 and page.endswith("</body>\n</html>\n") and "live-state" in page, page[-200:])
    check("page: policy in the header only", "connect-src 'self'" in headers["Content-Security-Policy"]
          and "http-equiv" not in page, headers)
    state = json.loads(re.search(r'id="live-state">(.*?)</script>', page, re.S)[1])
    check("page: text of the file", state["text"] == TEXT, state["text"][:200])
    for name in "live.js", "live.css":
        check(name, client.ask("GET", "/" + name)[2] == (ROOT / "python/gestell" / name).read_text())

    answer = client.solve()
    check("no change: the same text", answer["text"] == TEXT, answer["text"][:200])
    check("no change: verdict", verdict_of(answer["page"]) == "stable", verdict_of(answer["page"]))
    check("curves", [curve["title"] for curve in answer["curves"]] == ["Displacement of the frame", "Rotation of the frame",
          "Force on the ground", "Moment on the ground"], [curve["title"] for curve in answer["curves"]])
    response = gestell.Machine(FILE).solve("response").table("response")
    check("curves: millimetres", max(abs(1e3 * response["xi_m"] - answer["curves"][0]["series"][0]["values"])) < 1e-12)
    paths = {parameter["path"]: parameter for parameter in answer["parameters"]}
    speed = paths["drive.speed_rpm"]
    check("parameters", speed["values"] == [240] and speed["unit"] == "1/min" and speed["meaning"] != "", speed)

    # A saved file reproduces what the page shows, digit by digit.
    changes = [["drive.speed_rpm", "311.5"], ["support(2).stiffness(1)", "1.5e5"], ["link(rocker).mass", "0.4"],
               ["case.title", "a 'quoted' title"]]
    changed = client.solve(changes=changes)
    again = client.solve(text=changed["text"])
    check("changed text is reproduced", again["text"] == changed["text"], again["text"])
    check("changed page is reproduced", changed["page"] == again["page"])
    lost = set(TEXT.splitlines()) - set(changed["text"].splitlines())
    check("other lines stay", len(lost) <= len(changes), lost)
    with tempfile.TemporaryDirectory() as folder:
        saved = Path(folder, "saved.nml")
        saved.write_bytes(changed["text"].encode())
        options = [word for path, value in changes for word in ("--set", f"{path}={value}")]
        check("a saved file gives the same results", one_line(program, saved) == one_line(program, FILE, *options),
              one_line(program, saved))
    check("the file itself is unchanged", FILE.read_text() == TEXT)

    # Vectors that are not given whole, matrices, and whole numbers
    text = (ROOT / "data/rocking_sieve.nml").read_text()
    changed = client.solve(text=text, changes=[["foundation.damping(3)", "1.6"], ["foundation.stiffness(3,3)", "640"]])["text"]
    check("a vector without its end", "damping=0.0,0.0,1.6" in changed.replace(" ", ""), changed)
    again = client.solve(text=changed, changes=[["foundation.damping(2)", "0.1"], ["foundation.stiffness(3,3)", "650"]])
    matrix = next(one for one in client.solve(text=text)["parameters"] if one["path"] == "foundation.stiffness")
    check("a matrix changed twice", "650" in again.get("text", "") and "640" not in again["text"], again)
    check("description of a matrix", matrix.get("rows", 0) ** 2 == len(matrix["values"]) and "whole" not in matrix, matrix)
    check("a whole number", paths["joint(B).branch"].get("whole") is True, paths["joint(B).branch"])

    # Further tasks of the input, which the field shows as they are
    case = """&case title='tasks=', tasks='stability', "joints",'sweep'  ! tasks='power'
      /"""
    answer = client.solve(text=re.sub("&case[^/]*/", case, TEXT))
    tasks = next(one for one in answer["parameters"] if one["path"] == "case.tasks")
    check("joints on request", 'id="joints"' in answer["page"] and 'id="power"' not in answer["page"])
    check("tasks of the input", tasks["values"] == ["stability", "joints", "sweep"], tasks)
    close(server)


def refusals():
    """Bad values and hostile requests: one line of explanation, and the server goes on."""
    server = serve()
    client = Client(server)
    foreign = {"Host": "evil.example"}, {"Host": f"127.0.0.1:{server.server_port + 1}"}, {"Host": ""}, \
        {"Origin": "http://evil.example"}, {"Origin": "null"}
    for headers in foreign:
        for method, path in ("GET", "/"), ("POST", "/solve"):
            status, _, body = client.ask(method, path, "{}" if method == "POST" else None, **headers)
            check(f"foreign {headers}, {method}", status == 403 and TEXT[:40] not in body, (status, body[:99]))
    for path in "/../../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/live.py", "/data/khang_four_bar.nml", "/%00":
        check(f"GET {path}", client.ask("GET", path)[0] == 404, client.ask("GET", path)[0])
    kind = {"Content_Type": "application/json"}
    check("POST of a form", client.ask("POST", "/solve", "{}", Content_Type="text/plain")[0] == 404)
    check("PUT", client.ask("PUT", "/solve", "{}", **kind)[0] == 501)
    good = {"client": "a", "number": 1, "text": TEXT, "changes": []}
    bad = ["", "{", "[]", "1", "{}", "[" * 100000, json.dumps({**good, "number": "1"}), json.dumps({**good, "changes": [["a"]]}),
           json.dumps({**good, "text": 5}), json.dumps({**good, "changes": [["a", "b"]] * 1001}), json.dumps({**good, "client": "a" * 65}), "\xff",
           json.dumps({**good, "changes": [["drive.speed_rpm", 5]]})]
    for body in bad:
        status = client.ask("POST", "/solve", body.encode("latin1"), **kind)[0]
        check(f"request {body[:60]}", status == 400, status)
    check("too long a request", client.ask("POST", "/solve", None, Content_Length="99999999", **kind)[0] == 413)
    check("a request without length", client.ask("POST", "/solve", None, Content_Length="-1", **kind)[0] in (411, 413))
    refused = [("drive.speed_rpm", "fast"), ("frame.mass", "-1"), ("joint(A).radius", "5"), ("nothing.here", "1"), ("", ""),
               ("frame.mass", ""), ("drive.speed_rpm", "9" * 1000000), ("joint(A).type", "x" * 1000000)]
    for path, value in refused:
        answer = client.solve(changes=[[path, value]])
        message = answer.get("error", "")
        check(f"{path[:30]}={value[:30]}", message and "\n" not in message and len(message) < 1000, answer)
        check(f"after {path[:30]}", verdict_of(client.solve()["page"]) == "stable")
    # A text without a line break is a text, not the name of a file
    answer = client.solve(text=str(FILE))
    check("name of a file in place of a text", "error" in answer, answer)
    for text in "", "\n", "&", "\0", "&case /" * 1000, "\u2028" * 1000, "&load table='/dev/zero' /\n" + TEXT:
        answer = client.solve(text=text)
        check(f"text {text[:20]!r}", "error" in answer and "\n" not in answer["error"], answer)
    title = client.solve(changes=[["case.title", "t" * 1000000]])
    check("a title of a million characters", "t" * 1000 in title.get("text", "") or "error" in title, str(title)[:300])
    check("after all", verdict_of(client.solve()["page"]) == "stable")
    close(server)


def hurry():
    """200 changes at once, of two pages: the last of each gets its answer. A process that dies or takes too long is replaced."""
    server = serve()
    clients = Client(server, "one"), Client(server, "two")

    def ask(n):
        return n, clients[n % 2].solve(changes=[["drive.speed_rpm", str(200 + n)]], number=n // 2 + 1)

    with concurrent.futures.ThreadPoolExecutor(200) as pool:
        results = dict(pool.map(ask, range(200)))
    for n, answer in results.items():
        shown = answer.get("text", "").replace(" ", "")
        check(f"change {n}", answer.get("outdated") or f"speed_rpm={200 + n}" in shown, answer)
    check("the last answers", all("text" in results[n] for n in (198, 199)))
    check("outdated requests are not computed", sum("outdated" in answer for answer in results.values()) > 100)

    for number in range(1000, 1010, 2):
        server.solver._process.kill()
        # whether its death is noticed before or after the next request is sent
        answer = clients[0].solve(number=number)
        check("dead process", "text" in answer or "ended unexpectedly" in answer["error"], answer)
        check("after a dead process", "text" in clients[0].solve(number=number + 1))
    close(server)
    solver = Solver(FILE, seconds=0)
    check("too slow", "takes longer" in solver.answer("a", 1, TEXT, []))
    solver.stop()


def other_machines():
    """Machines in space, without mechanism or vibration, with hostile names; files that cannot be shown."""
    with tempfile.TemporaryDirectory() as folder:
        for name in "v_twin", "compressor", "mass_functions":
            file = next(iter([*ROOT.glob(f"*/{name}.nml"), *ROOT.glob(f"validation/*/{name}.nml")]), None)
            if file is None:
                continue
            server = serve(file)
            answer = Client(server).solve(text=file.read_text())
            check(f"{name}: text", answer.get("text") == file.read_text(), str(answer)[:300])
            close(server)
        file = Path(folder, "hostile.nml")
        quoted = HOSTILE.replace("'", "''")
        named = re.sub("(?m)title *= *'.*?'", lambda _: f"title='{quoted}'", TEXT).replace("'rocker'", "'</script><b>'")
        file.write_text(named + "&probe name='<img src=x>', position=0.1,0.1 /\n")
        server = serve(file)
        page = Client(server).ask("GET", "/")[2]
        for word in "<img", "<b>", "</script><script>d", "<!-- ":
            check(f"hostile names: {word}", word not in page, page[max(page.find(word) - 99, 0):][:200])
        check("hostile title is shown", html.escape(HOSTILE)[:20] in page)
        close(server)
        bad_files = {"no such file": None, "not UTF-8": b"&case title='\xff' /\n", "drive": b"&case title='a' /\n"}
        for words, content in bad_files.items():
            file = Path(folder, "bad.nml")
            if content:
                file.write_bytes(content)
            run = subprocess.run([sys.executable, "-m", "gestell", "live", file if content else "absent.nml", "--no-browser"],
                                 capture_output=True, text=True, check=False)
            check(f"file: {words}", run.returncode == 2 and len(run.stderr.splitlines()) == 1 and run.stdout == "", run)
        taken = serve()
        run = subprocess.run([sys.executable, "-m", "gestell", "live", FILE, "--no-browser", "--port", str(taken.server_port)],
                             capture_output=True, text=True, check=False)
        check("a port in use", run.returncode == 1 and len(run.stderr.splitlines()) == 1, run)
        close(taken)


# Works on the page as a user does, and writes what it finds into the title of the document.
PROBE = """
const found = {}, wait = ms => new Promise(done => setTimeout(done, ms));
const settled = async w => { do await wait(50); while (w.eval('busy')); };
const fire = (w, e, name) => e.dispatchEvent(new w.Event(name, { bubbles: true }));
const frame = address => new Promise(done => {
  const made = document.createElement('iframe');
  made.style.width = '1280px';
  made.style.height = '900px';
  made.onload = () => done(made);
  made.src = address;
  document.body.append(made);
});
(async () => {
  const one = await frame('/'), w = one.contentWindow, d = one.contentDocument;
  const controls = [...d.querySelectorAll('.live .value :is(input,select)')];
  const field = label => controls.find(e => e.getAttribute('aria-label').replace(/ [(][^)]*[)](?=,|$)/, '') === label);
  const speed = field('speed_rpm of drive'), slider = field('speed_rpm of drive, slider');
  found.fields = d.querySelectorAll('.live :is(.value,.choice)').length;
  found.expected = w.eval('state.parameters.reduce((n, p) => n + (p.list && p.words ? 1 : p.values.filter(v => v !== null).length), 0)');
  found.unlabelled = [...d.querySelectorAll('.live :is(input,select)')].filter(e => !e.getAttribute('aria-label') && !e.labels.length).length;
  found.before = d.querySelector('.live .state').textContent;
  const views = d.querySelector('.viewer .views').innerHTML, curve = d.querySelector('.curves polyline').getAttribute('points');
  slider.value = 1.5 * slider.value;
  fire(w, slider, 'input');
  fire(w, slider, 'change');
  await settled(w);
  found.speed = [speed.value, w.eval('state.text').includes('speed_rpm=360')];
  found.moved = d.querySelector('.viewer .views').innerHTML !== views;
  found.curve = d.querySelector('.curves polyline').getAttribute('points') !== curve;
  found.shownSpeed = d.querySelector('#summary dl').textContent.includes('360');
  const address = w.location.hash;
  found.address = address.length;
  let kept;
  w.URL.createObjectURL = blob => (kept = blob, 'data:,');
  d.querySelector('.tools button').click();
  found.saved = await kept.text() === w.eval('state.text');
  // 200 changes at once
  slider.max = 1000;
  for (let i = 0; i < 200; i++) {
    slider.value = 300 + i;
    fire(w, slider, 'input');
  }
  await settled(w);
  found.hurried = w.eval('state.text').includes('speed_rpm=499');
  found.requests = w.eval('number');
  // a value that is refused, and the way back
  const radius = field('radius of joint(A)');
  radius.value = 5;
  fire(w, radius, 'change');
  await settled(w);
  found.refused = [d.querySelector('.live .state').className, d.querySelector('.live .state').textContent,
    radius.getAttribute('aria-invalid'), d.body.className];
  radius.value = 0.07;
  fire(w, radius, 'change');
  await settled(w);
  found.mended = [d.querySelector('.live .state').className, radius.getAttribute('aria-invalid'), d.body.className];
  // words to choose from: one more, the first ones off again, while the last stays, and back
  const choice = d.querySelector('.live .choice'), tick = word => choice.querySelector(`[value=${word}]`);
  found.ticked = [...choice.querySelectorAll(':checked')].map(e => e.value).join();
  tick('joints').click();
  await settled(w);
  found.chosen = /tasks *= *([^/]*)/.exec(w.eval('state.text'))[1].replace(/\\s/g, '');
  for (const e of choice.querySelectorAll(':checked')) e.click();
  await settled(w);
  found.least = [...choice.querySelectorAll(':checked')].length;
  for (const word of ['stability', 'response', 'joints']) tick(word).click();
  await settled(w);
  found.asBefore = [...choice.querySelectorAll(':checked')].map(e => e.value).join() === found.ticked;
  // unstable, and the button of the page
  speed.value = 3144;
  fire(w, speed, 'change');
  await settled(w);
  found.unstable = d.querySelector('.live .state').className;
  // nothing remains of a change that is under way when another machine is shown
  speed.value = 3000;
  fire(w, speed, 'change');
  [...d.querySelectorAll('.tools button')].find(e => e.textContent === 'Reset').click();
  await settled(w);
  found.reset = w.eval('state.text === state.initial') && speed.value;
  // no number, and a refused value that does not stand in the way of others
  speed.value = '';
  fire(w, speed, 'change');
  found.restored = speed.value;
  radius.value = 5;
  fire(w, radius, 'change');
  await settled(w);
  const mass = field('mass of frame');
  mass.value = 19;
  fire(w, mass, 'change');
  await settled(w);
  found.around = [d.querySelector('.live .state').className, radius.value, w.eval('state.text').includes('mass=19')];
  // links of the page leave the address
  d.querySelector('nav a').click();
  found.kept = w.location.hash.length > 100;
  w.history.back();
  await wait(300);
  await settled(w);
  found.forth = w.eval('state.text === state.initial') && mass.value;
  w.history.forward();
  await wait(300);
  await settled(w);
  found.forward = mass.value;
  w.history.back();
  await wait(300);
  await settled(w);
  const all = d.querySelector('button.all');
  all.click();
  found.button = all.getAttribute('aria-pressed');
  // the address in another window, and the button Back
  const two = await frame('/' + address);
  await settled(two.contentWindow);
  await settled(two.contentWindow);
  found.link = two.contentWindow.eval('state.text').includes('speed_rpm=360');
  w.history.back();
  await wait(300);
  await settled(w);
  found.back = w.eval('state.text').includes('speed_rpm=3144');
  const broken = await frame('/#x:!!!');
  await settled(broken.contentWindow);
  found.broken = broken.contentDocument.querySelector('.live .state').textContent;
  found.foreign = w.performance.getEntriesByType('resource').map(e => e.name).filter(name => !name.startsWith(location.origin));
  for (const width of [1280, 660, 390]) {
    two.style.width = width + 'px';
    await wait(100);
    const root = two.contentDocument.documentElement;
    for (const part of two.contentDocument.querySelectorAll('.live details')) part.open = true;
    found['overflow' + width] = root.scrollWidth - root.clientWidth;
    const keys = [...two.contentDocument.querySelectorAll('a,button,summary,input,select,.wide')]
      .filter(e => e.getClientRects().length && !e.closest('[hidden]'));
    const focused = e => (e.focus(), two.contentDocument.activeElement === e);
    found['unreachable' + width] = keys.filter(e => !focused(e)).map(e => e.outerHTML.slice(0, 99));
  }
  const ids = [...two.contentDocument.querySelectorAll('[id]')].map(e => e.id);
  found.repeated = ids.filter((id, i) => ids.indexOf(id) < i);
})().catch(error => { found.error = String(error); }).then(() => { document.title = JSON.stringify(found); });
"""


class _ProbedHandler(live.Server.handler):
    """Serves the probe as well, which shows the page in frames."""

    def do_GET(self):
        if self.path == "/probe":
            self._send(200, "text/html", f"<!DOCTYPE html><title>none</title><body><script>{PROBE}</script></body>")
        else:
            super().do_GET()


class ProbedServer(live.Server):
    handler = _ProbedHandler


def browser():
    """The page in a browser."""
    if not BROWSER:
        print("no browser: the page is not looked at")
        return
    kept = dict(live.HEADERS)
    live.HEADERS.pop("X-Frame-Options")
    live.HEADERS["Content-Security-Policy"] = kept["Content-Security-Policy"].replace("frame-ancestors 'none'", "frame-src 'self'")\
        .replace("script-src 'self'", "script-src 'self' 'unsafe-eval'")
    server = serve(kind=ProbedServer)
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}", "--dump-dom",
                              "--virtual-time-budget=60000", "--window-size=1400,1000", server.address + "probe"],
                             capture_output=True, text=True, check=False, env={**os.environ, "HOME": folder}, timeout=300)
    close(server)
    live.HEADERS.update(kept)
    title = re.search("<title>(.*?)</title>", run.stdout, re.S)
    try:
        found = json.loads(html.unescape(title[1]))
    except (TypeError, ValueError):
        check("the page runs in a browser", False, run.stdout[:300] + run.stderr[-600:])
        return
    check("probe", "error" not in found, found)
    found["hurried requests"] = found.get("requests", 999) < 10
    expected = {"fields": found.get("expected"), "unlabelled": 0, "speed": ["360", True], "moved": True, "curve": True,
                "shownSpeed": True, "saved": True, "hurried": True, "hurried requests": True, "reset": "240", "restored": "240",
                "kept": True, "forth": "18", "forward": "19", "button": "true", "least": 1, "asBefore": True,
                "link": True, "back": True, "foreign": [], "repeated": []}
    for width in 1280, 660, 390:
        expected |= {f"overflow{width}": 0, f"unreachable{width}": []}
    for name, value in expected.items():
        check(f"in the browser: {name}", found.get(name) == value, found.get(name))
    check("in the browser: chosen", found.get("chosen") == "'stability','response','joints'", found.get("chosen"))
    check("in the browser: address", 100 < found.get("address", 0) < 4000, found.get("address"))
    check("in the browser: refused", "failed" in found["refused"][0] and "\n" not in found["refused"][1]
          and found["refused"][2:] == ["true", "outdated"], found["refused"])
    check("in the browser: mended", "stable" in found["mended"][0] and found["mended"][1:] == [None, ""], found["mended"])
    check("in the browser: around", found["around"] == ["verdict stable state", "0.07", True], found["around"])
    check("in the browser: unstable", "unstable" in found["unstable"], found["unstable"])
    check("in the browser: broken address", "no machine" in found["broken"], found["broken"])


answers(sys.argv[1])
refusals()
hurry()
other_machines()
browser()
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
