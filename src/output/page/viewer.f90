!> Viewer of a page: shows a machine in motion and its modes, with sliders for the crank angle and for the magnification of the
!> motion.
module gestell_output_page_viewer
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: newline
  use gestell_output_page_colours, only: colour_map
  use gestell_base_markup, only: escaped
  use gestell_output_page_lines, only: joined
  implicit none (type, external)
  private

  public :: viewer, viewer_script

  !> JavaScript that draws the scenes of all viewers of a page
  character(len=*), parameter :: script(*) = [character(len=124) :: &
    & "// Shows scenes in motion. With the rotation matrix R of the vector M t, the point p is drawn at", &
    & "// p + share (R p + M u - p), where u and t are the frame's displacement and rotation, and M is the magnification.", &
    & "for (const box of document.querySelectorAll('.viewer')) {", &
    & "  const colours = JSON.parse(box.dataset.colours), find = name => box.querySelector('.' + name);", &
    & "  const [choice, play, angle, zoom] = ['choice', 'play', 'angle', 'zoom'].map(find);", &
    & "  // `at`: instant that is shown. `chosen`: for each scene, the magnification that the reader has chosen", &
    & "  let scenes, scene, frames = 1, magnifications, views, at = 0, running = false, before;", &
    & "  const chosen = [];", &
    & "  // Between two instants the motion is interpolated.", &
    & "  const between = list => {", &
    & "    const i = Math.floor(at) % list.length, f = at - Math.floor(at), next = list[(i + 1) % list.length];", &
    & "    const mean = (a, b) => a + f * (b - a);", &
    & "    return list[i].map((a, k) => Array.isArray(a) ? a.map((x, n) => mean(x, next[k][n])) : mean(a, next[k]));", &
    & "  };", &
    & "  // Positions of all points at the time `at`.", &
    & "  function positions() {", &
    & "    const [ux, uy, uz, ...t] = between(scene.motion).map(x => x * magnifications[zoom.value]);", &
    & "    const moving = scene.moving.length ? between(scene.moving) : [];", &
    & "    const turn = Math.hypot(...t), c = Math.cos(turn), s = Math.sin(turn);", &
    & "    const [a, b, d] = turn > 0 ? t.map(x => x / turn) : [0, 0, 0];", &
    & "    return scene.points.map(([x, y, z, share, index]) => {", &
    & "      if (index >= 0) [x, y, z] = moving[index];", &
    & "      const along = (1 - c) * (a * x + b * y + d * z);", &
    & "      return [x + share * (c * x + s * (b * z - d * y) + a * along + ux - x),", &
    & "        y + share * (c * y + s * (d * x - a * z) + b * along + uy - y),", &
    & "        z + share * (c * z + s * (a * y - b * x) + d * along + uz - z)];", &
    & "    });", &
    & "  }", &
    & "  function element(parent, name, attributes) {", &
    & "    const made = document.createElementNS('http://www.w3.org/2000/svg', name);", &
    & "    for (const key in attributes) made.setAttribute(key, attributes[key]);", &
    & "    return parent.appendChild(made);", &
    & "  }", &
    & "  // Colours of the page: greys from black to white change places on dark screens.", &
    & "  function paint(colour) {", &
    & "    const code = String(colour).toLowerCase(), grey = /^#(..)\1\1$/.exec(code);", &
    & "    if (grey) return 'var(--g' + Math.round(parseInt(grey[1], 16) / 17).toString(16) + ')';", &
    & "    return colours[code] || (/^#[0-9a-f]{6}$/.test(code) ? code : 'currentColor');", &
    & "  }", &
    & "  const circle = 'M-4,0a4,4 0 1 0 8,0a4,4 0 1 0 -8,0z';", &
    & "  const symbols = { pin: circle, centre: circle + 'M-6,0h12M0,-6v12', probe: 'M0,-7L7,0L0,7L-7,0z' };", &
    & "  // Draws the chosen scene in new pictures. All views have the same scale, and room for the motion.", &
    & "  function open() {", &
    & "    const part = at / frames, steps = [], largest = 10 * scene.magnification;", &
    & "    frames = scene.motion.length;", &
    & "    for (let ten = scene.name ? 0.1 : 1; ten < largest; ten *= 10) steps.push(ten, 2 * ten, 5 * ten);", &
    & "    const all = [...steps.filter(x => x < largest), scene.magnification, largest];", &
    & "    magnifications = [...new Set(all)].sort((a, b) => a - b);", &
    & "    const wanted = chosen[choice.value] || scene.magnification;", &
    & "    const distance = i => Math.abs(Math.log(magnifications[i] / wanted));", &
    & "    zoom.max = magnifications.length - 1;", &
    & "    zoom.value = magnifications.reduce((best, _, i) => distance(i) < distance(best) ? i : best, 0);", &
    & "    angle.max = frames - 1;", &
    & "    angle.parentNode.firstChild.textContent = scene.name ? 'phase ' : 'crank angle ';", &
    & "    const extents = scene.views.map(() => [1 / 0, 1 / 0, -1 / 0, -1 / 0]);", &
    & "    const flat = (view, p) => [p[view.right], view.flip ? p[view.up] : -p[view.up]];", &
    & "    for (at = 0; at < frames; at += Math.max(1, Math.floor(frames / 24))) {", &
    & "      const now = positions();", &
    & "      scene.views.forEach((view, v) => now.forEach(p => flat(view, p).forEach((x, k) => {", &
    & "        extents[v][k] = Math.min(extents[v][k], x);", &
    & "        extents[v][k + 2] = Math.max(extents[v][k + 2], x);", &
    & "      })));", &
    & "    }", &
    & "    at = part * frames;", &
    & "    const size = Math.max(...extents.map(e => Math.max(e[2] - e[0], e[3] - e[1])));", &
    & "    const scale = 400 / (size || 1), margin = 20;", &
    & "    find('views').replaceChildren();", &
    & "    views = scene.views.map((view, v) => {", &
    & "      const [left, top, right, bottom] = extents[v], figure = document.createElement('figure');", &
    & "      const [width, height] = [right - left, bottom - top].map(x => Math.round(x * scale + 2 * margin));", &
    & "      const picture = element(figure, 'svg', { viewBox: `0 0 ${width} ${height}`, role: 'img',", &
    & "        'aria-label': (scene.name || 'The machine in motion') + (view.name ? ', ' + view.name : '') });", &
    & "      figure.style.flex = `0 1 ${Math.max(width, 120)}px`;", &
    & "      picture.style.maxWidth = width + 'px';", &
    & "      figure.appendChild(document.createElement('figcaption')).textContent = view.name;", &
    & "      find('views').append(figure);", &
    & "      const shapes = scene.lines.filter(line => !(line.view >= 0 && line.view !== v)).map(line => {", &
    & "        const single = line.kind in symbols && line.points.length === 1;", &
    & "        const name = single ? 'path' : line.kind === 'frame' ? 'polygon' : 'polyline';", &
    & "        const shape = element(picture, name, { class: line.kind });", &
    & "        if (single) shape.setAttribute('d', symbols[line.kind]);", &
    & "        shape.style.stroke = paint(line.colour);", &
    & "        if (line.kind === 'frame') shape.style.fill = paint(line.colour);", &
    & "        return [shape, line.points, single];", &
    & "      });", &
    & "      const place = p => flat(view, p).map((x, k) => (margin + (x - (k ? top : left)) * scale).toFixed(1)).join();", &
    & "      return now => shapes.forEach(([shape, points, single]) => single", &
    & "        ? shape.setAttribute('transform', `translate(${place(now[points[0]])})`)", &
    & "        : shape.setAttribute('points', points.map(i => place(now[i])).join(' ')));", &
    & "    });", &
    & "    draw();", &
    & "  }", &
    & "  function draw() {", &
    & "    const now = positions(), times = magnifications[zoom.value], shown = +times.toPrecision(3) + ' times';", &
    & "    const i = Math.floor(at) % frames;", &
    & "    views.forEach(view => view(now));", &
    & "    const degrees = Math.round(scene.name ? 360 * i / frames : scene.degrees[i]) + ' deg';", &
    & "    const words = scene.name ? shown : times === 1 ? 'motion to scale' : 'motion magnified ' + shown;", &
    & "    angle.value = i;", &
    & "    for (const [control, text] of [[angle, degrees], [zoom, words]]) {", &
    & "      control.setAttribute('aria-valuetext', text);", &
    & "      control.nextElementSibling.textContent = text;", &
    & "    }", &
    & "  }", &
    & "  // A period takes as many seconds as the scene says.", &
    & "  function step(time) {", &
    & "    if (!running) return;", &
    & "    if (before !== undefined) at = (at + (time - before) / 1000 / scene.seconds * frames) % frames;", &
    & "    before = time;", &
    & "    draw();", &
    & "    requestAnimationFrame(step);", &
    & "  }", &
    & "  function run(on) {", &
    & "    running = on;", &
    & "    before = undefined;", &
    & "    play.textContent = on ? 'Pause' : 'Play';", &
    & "    if (on) requestAnimationFrame(step);", &
    & "  }", &
    & "  function choose() {", &
    & "    scene = scenes[choice.value];", &
    & "    open();", &
    & "  }", &
    & "  // Shows a list of scenes. The reader's choices remain as they are.", &
    & "  box.show = list => {", &
    & "    const last = Math.min(Math.max(choice.selectedIndex, 0), list.length - 1);", &
    & "    scenes = list;", &
    & "    choice.replaceChildren(...scenes.map((each, i) => new Option(each.name || 'machine in motion', i)));", &
    & "    choice.selectedIndex = last;", &
    & "    choice.parentNode.hidden = scenes.length < 2;", &
    & "    choose();", &
    & "  };", &
    & "  play.onclick = () => run(!running);", &
    & "  angle.oninput = () => { run(false); at = +angle.value; draw(); };", &
    & "  zoom.oninput = () => { chosen[choice.value] = magnifications[zoom.value]; draw(); };", &
    & "  zoom.onchange = open;", &
    & "  choice.onchange = choose;", &
    & "  box.hidden = false;", &
    & "  box.show(JSON.parse(box.querySelector('script').textContent));", &
    & "  run(!matchMedia('(prefers-reduced-motion: reduce)').matches);", &
    & "}"]

contains

  !> HTML of a viewer. Browsers that run no scripts do not show it. The page must contain `viewer_script` once, after its last
  !> viewer. Other scripts of the page may call the viewer's function `show` with another list of scenes.
  pure function viewer(json) result(words)
    !> List of scenes in JSON, each an object with these members:
    !> `name`: caption; empty for the machine in motion
    !> `views`: list of {name, right, up, flip}: the axes (0 to 2) that point right and up; `flip` is true if `up` points down
    !> `points`: list of [x, y, z, share, moving]: position (m), share of the frame's motion that the point follows, and index of
    !> the point in each element of `moving`, or -1
    !> `lines`: list of {kind, colour, view, points}: what the line is, its colour #rrggbb, the only view in which it appears (-1:
    !> all views), and the indices of its points
    !> `moving`: for each instant, a list of positions relative to the frame (m); a single list if they do not change
    !> `motion`: for each instant, displacement (m) and rotation vector (rad) of the frame
    !> `degrees`: for each instant, the crank angle
    !> `magnification`: magnification of the motion at the beginning
    !> `seconds`: how long the viewer shows a period
    character(len=*), intent(in) :: json
    character(len=:), allocatable :: words

    words = "<noscript><p>The animation needs JavaScript.</p></noscript>" // newline &
      & // "<div class=""viewer"" hidden data-colours=""" // escaped(colour_map()) // """><div class=""views""></div>" // newline &
      & // "<p class=""controls""><button type=""button"" class=""play"">Play</button>" // newline &
      & // "<label>show <select class=""choice""></select></label>" // newline &
      & // slider("crank angle", "angle") // slider("magnification", "zoom") // "</p>" &
      & // newline // "<script type=""application/json"">" // without_tags(json) // "</script></div>" // newline
  end function viewer

  !> HTML of a slider with its label and the text of its value, which is not announced while the animation runs.
  pure function slider(label, name) result(words)
    !> `name`: name by which the script finds the slider
    character(len=*), intent(in) :: label, name
    character(len=:), allocatable :: words

    words = "<label>" // label // " <input type=""range"" class=""" // name // """ min=""0"" value=""0"">" &
      & // "<output aria-live=""off""></output></label>" // newline
  end function slider

  !> Element <script> that runs the viewers above it.
  pure function viewer_script() result(words)
    character(len=:), allocatable :: words

    words = "<script>" // newline // joined(script) // "</script>" // newline
  end function viewer_script

  !> JSON in which \u003c replaces the character <, which occurs only in strings: no string can end the element <script>.
  pure function without_tags(json) result(safe)
    character(len=*), intent(in) :: json
    character(len=:), allocatable :: safe
    type(growing_text_type) :: pieces
    integer :: first, next

    first = 1
    do
      next = index(json(first:), "<")
      if (next == 0) exit
      call pieces%append(json(first:first + next - 2) // "\u003c")
      first = first + next
    end do
    call pieces%append(json(first:))
    safe = pieces%whole()
  end function without_tags

end module gestell_output_page_viewer
