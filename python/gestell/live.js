// Makes the page of a machine live: a field for each value of the input, from which the rest of the page follows.
'use strict';
const state = JSON.parse(document.getElementById('live-state').textContent);
const client = crypto.getRandomValues(new Uint32Array(2)).join('-');
// Changes that the server has not accepted yet, by their paths; number of the last request; whether one is under way.
const changes = new Map();
let number = 0, busy = false, wanted = false;

function make(name, attributes = {}, ...content) {
  const made = document.createElement(name);
  for (const key in attributes) key in made ? made[key] = attributes[key] : made.setAttribute(key, attributes[key]);
  made.append(...content);
  return made;
}

// ---- the state in the address of the page: the text of the input, compressed

const encode = bytes => btoa(bytes.reduce((all, byte) => all + String.fromCharCode(byte), ''))
  .replace(/\+/g, '-').replace(/\//g, '_').replace(/=+$/, '');
const decode = words => Uint8Array.from(atob(words.replace(/-/g, '+').replace(/_/g, '/')), c => c.charCodeAt(0));
const through = async (bytes, stream) =>
  new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

// The machine of the address: the name of its file, a colon and the compressed text; the machine of the file if there is none.
async function readAddress() {
  const [, name, packed] = /^#(.*):(.*)$/.exec(location.hash) || [];
  if (location.hash.length > 1 && !packed) throw new Error('no machine');
  if (!packed) return { text: state.initial, name: state.file };
  return { text: new TextDecoder().decode(await through(decode(packed), new DecompressionStream('deflate-raw'))),
    name: decodeURIComponent(name) };
}

// The browser's button Back returns to the state before a change; all positions of a slider that is drawn are one change.
let changing = false;

async function putInAddress(ends, replaces = changing) {
  const packed = encode(await through(new TextEncoder().encode(state.text), new CompressionStream('deflate-raw')));
  const address = '#' + encodeURIComponent(state.name) + ':' + packed;
  changing = !ends;
  if (location.hash === address) return;
  try {
    history[replaces ? 'replaceState' : 'pushState'](null, '', address);
  } catch {
    // browsers refuse many new addresses within a short time; the next change sets it
  }
}

// ---- the fields

const live = make('aside', { className: 'live' }), status = make('p', { className: 'verdict state', role: 'status' });
live.setAttribute('aria-label', 'Input');
const fields = make('div'), controls = new Map();
const save = make('button', { type: 'button' }, 'Save input file'), link = make('button', { type: 'button' }, 'Copy link');
const reset = make('button', { type: 'button' }, 'Reset');
live.append(make('h2', {}, 'Input'), status, make('div', { className: 'tools' }, save, link, reset), fields);

save.onclick = () => {
  const file = make('a', { href: URL.createObjectURL(new Blob([state.text])), download: state.name });
  file.click();
  setTimeout(() => URL.revokeObjectURL(file.href), 1000);
};
link.onclick = async () => {
  await putInAddress(true);
  try {
    await navigator.clipboard.writeText(location.href);
    link.textContent = 'Copied';
  } catch {
    link.textContent = 'Copy the address of the page';
  }
  setTimeout(() => { link.textContent = 'Copy link'; }, 2000);
};
reset.onclick = () => load({ text: state.initial, name: state.file });

// Words about the values that a key allows.
function rangeOf({ least, most, positive }) {
  const words = [];
  if (positive) words.push('greater than 0');
  if (least !== null && least !== undefined && !(positive && least <= 0)) words.push('at least ' + least);
  if (most !== null && most !== undefined) words.push('at most ' + most);
  return words.join(', ');
}

// A slider reaches from 0 to twice the value, but no further than the key allows. At 0 the other elements say how far.
function setSlider(slider, value, { least, most, positive, whole, values }) {
  const reach = Math.abs(value) || Math.max(...values.map(Math.abs)) || 1;
  let low = value - reach, high = value + reach;
  if (positive) low = Math.max(low, whole ? 1 : reach / 100);
  if (least !== null) low = Math.max(low, least);
  if (most !== null) high = Math.min(high, most);
  Object.assign(slider, { min: low, max: high, step: whole ? 1 : 'any', value });
}

// Whether a key takes any number of the words that it allows: each word has a box to tick, all boxes stand for one value.
const isChoice = ({ list, words }) => list && words;
const placesOf = parameter =>
  isChoice(parameter) ? [0] : parameter.values.flatMap((value, place) => value === null ? [] : [place]);

// Path of a single value. Matrices are given column by column.
function pathOf(parameter, place) {
  const { path, values, rows } = parameter;
  if (isChoice(parameter)) return path;
  if (rows) return `${path}(${place % rows + 1},${Math.floor(place / rows) + 1})`;
  return values.length > 1 ? `${path}(${place + 1})` : path;
}

function addValue(parameter, place, box, help) {
  const several = parameter.values.length > 1, path = pathOf(parameter, place);
  const value = parameter.values[place], unit = parameter.unit ? ` (${parameter.unit})` : '';
  const dot = path.lastIndexOf('.'), name = path.slice(dot + 1) + ' of ' + path.slice(0, dot) + unit;
  const isNumber = 'least' in parameter, row = make('div', { className: 'value' });
  let field, slider;
  if (!isNumber && parameter.words && !several) {
    const words = parameter.words.split(/, */);
    field = make('select', {}, ...[...new Set([value, ...words])].map(word => new Option(word, word)));
    field.value = value;
  } else {
    const type = isNumber ? 'number' : 'text';
    const step = parameter.whole ? 1 : 'any';
    field = make('input', { type, step, value: value ?? '', className: isNumber ? '' : 'words' });
  }
  field.setAttribute('aria-label', name);
  field.setAttribute('aria-describedby', help);
  if (several) row.append(make('span', { className: 'unit' }, path.slice(parameter.path.length)));
  row.append(field);
  if (isNumber) {
    slider = make('input', { type: 'range' });
    slider.setAttribute('aria-label', name + ', slider');
    slider.setAttribute('aria-describedby', help);
    setSlider(slider, value, parameter);
    slider.oninput = () => {
      field.value = Number((+slider.value).toPrecision(4));
      change(path, field.value, false);
    };
    slider.onchange = () => {
      if (slider.value === slider.min || slider.value === slider.max) setSlider(slider, +field.value, parameter);
      change(path, field.value, true);
    };
    row.append(slider);
  }
  // A number that is being typed is sent when the reader pauses.
  let pause;
  field.oninput = () => {
    clearTimeout(pause);
    pause = setTimeout(() => { if (field.validity.valid && field.value !== '') change(path, field.value, false); }, 400);
  };
  field.onchange = () => {
    clearTimeout(pause);
    const known = controls.get(path).parameter.values[place];
    if (isNumber && (!field.validity.valid || field.value === '')) {
      // no number: the value that the machine has
      field.value = known;
      changes.delete(path);
      refused.delete(path);
      field.removeAttribute('aria-invalid');
      return;
    }
    if (slider) setSlider(slider, +field.value, parameter);
    change(path, field.value, true);
  };
  box.append(row);
  controls.set(path, { field, slider, parameter });
}

function addChoice(parameter, box, help) {
  const { path } = parameter, field = make('div', { className: 'choice', role: 'group' });
  field.setAttribute('aria-label', path);
  field.setAttribute('aria-describedby', help);
  const boxes = parameter.words.split(/, */).map(word => make('input', { type: 'checkbox', value: word }));
  field.append(...boxes.map(each => make('label', {}, each, ' ' + each.value)));
  field.onchange = event => {
    const chosen = boxes.filter(each => each.checked);
    // one word at least
    if (chosen.length) change(path, chosen.map(each => `'${each.value}'`).join(), true);
    else event.target.checked = true;
  };
  const show = ({ values }) => {
    const chosen = values.map(word => word.toLowerCase());
    for (const each of boxes) each.checked = chosen.includes(each.value.toLowerCase());
  };
  show(parameter);
  box.append(field);
  controls.set(path, { field, parameter, show });
}

function addFields() {
  const open = new Set([...fields.querySelectorAll('details[open]')].map(each => each.dataset.group));
  const first = !fields.children.length;
  fields.replaceChildren();
  controls.clear();
  let group, name;
  state.parameters.forEach((parameter, i) => {
    const owner = parameter.path.slice(0, parameter.path.lastIndexOf('.')), key = parameter.path.slice(owner.length + 1);
    if (owner !== name) {
      name = owner;
      const shown = first ? owner === 'drive' : open.has(owner);
      group = make('details', { className: 'group', open: shown }, make('summary', {}, owner));
      group.dataset.group = owner;
      fields.append(group);
    }
    const id = 'help-' + i, box = make('div', { className: 'key' });
    const label = make('span', { className: 'label' }, key + ' ', make('span', { className: 'unit' }, parameter.unit));
    const range = rangeOf(parameter), help = make('p', { className: 'help', id }, parameter.meaning + (range ? ': ' + range : ''));
    label.title = help.textContent;
    box.append(label);
    if (isChoice(parameter)) addChoice(parameter, box, id);
    else for (const place of placesOf(parameter)) addValue(parameter, place, box, id);
    box.append(help);
    group.append(box);
  });
}

// Values that others than the reader have changed. The field in which the reader types stays, unless another machine is shown.
function refreshFields(another) {
  const paths = state.parameters.flatMap(one => placesOf(one).map(place => pathOf(one, place)));
  const units = list => list.map(({ unit }) => unit).join();
  const known = [...new Set([...controls.values()].map(({ parameter }) => parameter))];
  if (paths.join() !== [...controls.keys()].join() || units(known) !== units(state.parameters)) addFields();
  for (const parameter of state.parameters) for (const place of placesOf(parameter)) {
    const path = pathOf(parameter, place), control = controls.get(path), value = parameter.values[place];
    control.parameter = parameter;
    control.field.removeAttribute('aria-invalid');
    const typing = [control.field, control.slider].some(each => each?.contains(document.activeElement));
    if (changes.has(path) || typing && !another) continue;
    if (control.show) {
      control.show(parameter);
      continue;
    }
    const shown = control.field.value;
    if ('least' in parameter ? shown !== '' && +shown === value : shown === value) continue;
    control.field.value = value ?? '';
    if (control.slider) setSlider(control.slider, value, parameter);
  }
}

// ---- requests

// Changes that were refused; whether the next answer ends a change; whether another machine is to be shown.
const refused = new Map();
let commit = false, another = false;

function change(path, value, commits) {
  changes.set(path, value);
  refused.delete(path);
  commit ||= commits;
  send();
}

// One request at a time: changes that come meanwhile are sent together when its answer is there.
async function send() {
  wanted = true;
  if (busy) return;
  busy = true;
  const slow = setTimeout(() => status.classList.add('computing'), 700);
  try {
    while (wanted) {
      wanted = false;
      const text = state.text, fresh = [...changes], ends = commit, loads = another;
      commit = another = false;
      // Values that are possible only together: those refused before are tried again with the new ones, then left out.
      let sent = [...refused, ...fresh], answer = await ask(text, sent);
      if (answer.error && refused.size && fresh.length) {
        answer = await ask(text, fresh);
        if (!answer.error) sent = fresh;
      }
      if (state.text !== text || answer.outdated) {
        wanted = true;
        commit ||= ends;
        another ||= loads;
      } else if (answer.error) {
        fail(answer.error, sent);
      } else {
        await accept(answer, fresh, ends, loads);
      }
    }
  } catch (error) {
    fail('the page cannot show this machine: ' + error, []);
  } finally {
    clearTimeout(slow);
    status.classList.remove('computing');
    busy = false;
  }
}

async function ask(text, sent) {
  try {
    const reply = await fetch('/solve', { method: 'POST', headers: { 'Content-Type': 'application/json' },
      body: JSON.stringify({ client, number: ++number, text, changes: sent }) });
    return reply.ok ? await reply.json() : { error: await reply.text() };
  } catch {
    return { error: 'gestell live has ended: start it again and reload this page' };
  }
}

// Shows another machine. Changes that were not accepted are forgotten. `quiet`: the address shows it already.
let quiet = false;

function load({ text, name }, isQuiet = false) {
  state.text = text;
  state.name = name;
  changes.clear();
  refused.clear();
  commit = another = true;
  quiet = isQuiet;
  return send();
}

function fail(message, sent) {
  status.className = 'verdict state failed';
  status.textContent = message;
  document.body.classList.add('outdated');
  for (const [path, value] of sent) {
    refused.set(path, value);
    if (changes.get(path) === value) changes.delete(path);
    controls.get(path)?.field.setAttribute('aria-invalid', 'true');
  }
}

async function accept(answer, sent, ends, loads) {
  for (const [path, value] of sent) if (changes.get(path) === value) changes.delete(path);
  refused.clear();
  Object.assign(state, answer);
  document.body.classList.remove('outdated');
  refreshFields(loads);
  showPage(new DOMParser().parseFromString(answer.page, 'text/html'));
  if (quiet) changing = false;
  else await putInAddress(ends);
  quiet = false;
}

// ---- the page

// Takes the sections of the new page. The viewer goes on moving, and opened parts stay open.
function showPage(fresh) {
  const opened = [...document.querySelectorAll('main details[open] > summary')].map(summary => summary.textContent);
  const every = [...document.querySelectorAll('main .all[aria-pressed=true]')].map(button => button.closest('section').id);
  const scrolled = [...document.querySelectorAll('main .wide')].filter(box => box.scrollLeft)
    .map(box => [box.getAttribute('aria-label'), box.scrollLeft]);
  const focused = document.activeElement.closest?.('main section'), height = scrollY;
  const place = focused ? [...focused.querySelectorAll('a,button,summary,.wide')].indexOf(document.activeElement) : -1;
  const main = document.querySelector('main'), motion = document.getElementById('motion');
  const viewer = fresh.querySelector('.viewer');
  const [summary, ...others] = [...fresh.querySelector('main').children].filter(section => section.id !== 'motion');
  for (const section of [...main.children]) if (section !== motion && section !== curves) section.remove();
  main.prepend(summary);
  main.append(...others);
  for (const each of main.querySelectorAll('details > summary')) each.parentNode.open = opened.includes(each.textContent);
  for (const button of main.querySelectorAll('button.all')) {
    button.onclick = () => button.setAttribute('aria-pressed', button.nextElementSibling.classList.toggle('every'));
    if (every.includes(button.closest('section').id)) button.click();
  }
  if (viewer && motion) motion.querySelector('.viewer').show(JSON.parse(viewer.querySelector('script').textContent));
  document.title = fresh.title;
  showName();
  document.querySelector('h1').textContent = fresh.querySelector('h1').textContent;
  showStatus();
  showCurves();
  for (const box of main.querySelectorAll('.wide')) box.scrollLeft = new Map(scrolled).get(box.getAttribute('aria-label')) || 0;
  if (place >= 0 && focused.id !== 'motion') document.getElementById(focused.id)
    ?.querySelectorAll('a,button,summary,.wide')[place]?.focus({ preventScroll: true });
  scrollTo(0, height);
}

function showName() {
  document.querySelector('.sub').textContent = state.name + ', as changed on this page';
}

function showStatus() {
  const verdict = document.querySelector('#summary .verdict');
  status.className = (verdict?.className || 'verdict') + ' state';
  status.replaceChildren(...(verdict ? verdict.cloneNode(true).childNodes : ['no verdict']));
}

// ---- curves over the crank angle

const curves = make('section', { id: 'curves' }, make('h2', {}, 'Motion and forces over the crank angle'));
const dashes = ['', '7 4', '2 3'], inks = ['--c1', '--c2', '--c3'];
const short = x => +x.toPrecision(3) + '';

function showCurves() {
  curves.hidden = !state.curves.length;
  const box = make('div', { className: 'curves' });
  box.append(...state.curves.map(diagram));
  curves.replaceChildren(curves.firstChild, box);
}

function diagram({ title, unit, x, series }) {
  const width = 480, height = 220, left = 60, right = 10, top = 10, bottom = 40;
  const all = series.flatMap(one => one.values);
  const low = all.reduce((a, b) => Math.min(a, b), 0), high = all.reduce((a, b) => Math.max(a, b), 0);
  const spread = high - low || 1, step = stepFor(spread);
  const across = value => left + (value - x[0]) / (x[x.length - 1] - x[0]) * (width - left - right);
  const up = value => top + (high - value) / spread * (height - top - bottom);
  const picture = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  const add = (name, attributes, words = '') => {
    const made = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    made.textContent = words;
    picture.append(made);
  };
  picture.setAttribute('viewBox', `0 0 ${width} ${height}`);
  picture.setAttribute('role', 'img');
  const peaks = series.map(({ name, values }) => `${name} ${short(Math.max(...values.map(Math.abs)))} ${unit}`).join(', ');
  picture.setAttribute('aria-label', `${title} over the crank angle; largest values: ${peaks}`);
  for (let value = Math.ceil(low / step) * step; value <= high + step / 1e6; value += step) {
    add('path', { class: 'axis', d: `M${left},${up(value)}H${width - right}` });
    add('text', { x: left - 5, y: up(value) + 4, 'text-anchor': 'end' }, short(Math.abs(value) < step / 1e6 ? 0 : value));
  }
  for (let k = 0; k <= 4; k++) {
    const angle = x[0] + (x[x.length - 1] - x[0]) * k / 4;
    add('text', { x: across(angle), y: height - bottom + 17, 'text-anchor': k === 4 ? 'end' : 'middle' }, short(angle) + '°');
  }
  series.forEach(({ name, values }, i) => {
    const style = `stroke: var(${inks[i % inks.length]}); stroke-dasharray: ${dashes[i % dashes.length]}`;
    add('polyline', { style, points: values.map((value, k) => across(x[k]).toFixed(1) + ',' + up(value).toFixed(1)).join(' ') });
    add('path', { style: style + '; stroke-width: 2', d: `M${left + 110 * i},${height - 8}h25` });
    add('text', { x: left + 110 * i + 30, y: height - 4 }, name);
  });
  return make('figure', {}, picture, make('figcaption', {}, `${title} (${unit})`));
}

// Distance of about four lines of a grid: 1, 2 or 5 times a power of ten.
function stepFor(spread) {
  const power = 10 ** Math.floor(Math.log10(spread / 4));
  return power * [1, 2, 5, 10].find(factor => factor * power >= spread / 4);
}

// ---- beginning

state.initial = state.text;
state.file = state.name;
document.querySelector('header').after(live);
// What moves stands at the top, below the summary.
document.getElementById('summary').after(...[document.getElementById('motion'), curves].filter(Boolean));
addFields();
showStatus();
showCurves();
showName();
const readsAddress = quiet => readAddress().then(found => load(found, quiet), () => fail('the address holds no machine', []));
window.onpopstate = () => readsAddress(true);
// Links within the page leave the address as it is.
document.addEventListener('click', event => {
  const target = event.target.closest?.('a[href^="#"]')?.getAttribute('href');
  if (!target) return;
  event.preventDefault();
  const section = document.getElementById(target.slice(1));
  section.tabIndex = -1;
  section.scrollIntoView();
  section.focus({ preventScroll: true });
});
if (location.hash.length > 1) readsAddress(true);
else putInAddress(true, true);
