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

async function textOfAddress() {
  const packed = location.hash.slice(1);
  if (!packed) return state.initial;
  return new TextDecoder().decode(await through(decode(packed), new DecompressionStream('deflate-raw')));
}

// The browser's button Back returns to the state before a change; all positions of a slider that is drawn are one change.
let changing = false;

async function putInAddress(ends) {
  const packed = encode(await through(new TextEncoder().encode(state.text), new CompressionStream('deflate-raw')));
  if (location.hash.slice(1) !== packed) history[changing ? 'replaceState' : 'pushState'](null, '', '#' + packed);
  changing = !ends;
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
reset.onclick = () => load(state.initial);

// Words about the values that a key allows.
function rangeOf({ least, most, positive }) {
  const words = [];
  if (positive) words.push('greater than 0');
  if (least !== null && least !== undefined && !(positive && least <= 0)) words.push('at least ' + least);
  if (most !== null && most !== undefined) words.push('at most ' + most);
  return words.join(', ');
}

// A slider reaches from 0 to twice the value, but no further than the key allows.
function setSlider(slider, value, { least, most, positive, whole }) {
  const reach = Math.abs(value) || 1;
  let low = value - reach, high = value + reach;
  if (positive) low = Math.max(low, whole ? 1 : reach / 100);
  if (least !== null) low = Math.max(low, least);
  if (most !== null) high = Math.min(high, most);
  Object.assign(slider, { min: low, max: high, step: whole ? 1 : 'any', value });
}

// Path of a single value. Matrices are given column by column.
function pathOf({ path, values, rows }, place) {
  if (rows) return `${path}(${place % rows + 1},${Math.floor(place / rows) + 1})`;
  return values.length > 1 ? `${path}(${place + 1})` : path;
}

function addValue(parameter, place, box, help) {
  const several = parameter.values.length > 1, path = pathOf(parameter, place);
  const value = parameter.values[place], name = path.slice(path.indexOf('.') + 1) + ' of ' + path.split('.')[0];
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
  row.append(field);
  if (isNumber) {
    slider = make('input', { type: 'range' });
    slider.setAttribute('aria-label', name + ', slider');
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
  const typed = commits => {
    if (isNumber && !field.validity.valid || isNumber && field.value === '') return;
    if (slider) setSlider(slider, +field.value, parameter);
    change(path, field.value, commits);
  };
  field.oninput = () => typed(false);
  field.onchange = () => typed(true);
  box.append(row);
  controls.set(path, { field, slider, parameter });
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
    parameter.values.forEach((value, place) => value === null || addValue(parameter, place, box, id));
    box.append(help);
    group.append(box);
  });
}

// Values that others than the reader have changed.
function refreshFields() {
  const paths = state.parameters.flatMap(one => one.values.flatMap((value, place) => value === null ? [] : [pathOf(one, place)]));
  if (paths.join() !== [...controls.keys()].join()) addFields();
  for (const parameter of state.parameters) parameter.values.forEach((value, place) => {
    const path = pathOf(parameter, place), control = controls.get(path);
    if (!control) return;
    control.parameter = parameter;
    control.field.removeAttribute('aria-invalid');
    if (changes.has(path) || control.field === document.activeElement || control.slider === document.activeElement) return;
    const shown = control.field.value;
    if ('least' in parameter ? shown !== '' && +shown === value : shown === value) return;
    control.field.value = value ?? '';
    if (control.slider) setSlider(control.slider, value, parameter);
  });
}

// ---- requests

let commit = false;

function change(path, value, commits) {
  changes.set(path, value);
  commit ||= commits;
  send();
}

// One request at a time: changes that come meanwhile are sent together when its answer is there.
async function send() {
  wanted = true;
  if (busy) return;
  busy = true;
  while (wanted) {
    wanted = false;
    const sent = [...changes], commits = commit;
    commit = false;
    const tasks = state.parameters.find(parameter => parameter.path === 'case.tasks')?.values || [];
    let answer;
    try {
      const reply = await fetch('/solve', { method: 'POST', headers: { 'Content-Type': 'application/json' },
        body: JSON.stringify({ client, number: ++number, text: state.text, changes: sent, tasks }) });
      answer = reply.ok ? await reply.json() : { error: await reply.text() };
    } catch {
      answer = { error: 'gestell live has ended: start it again and reload this page' };
    }
    if (answer.outdated) wanted = true;
    else if (answer.error) fail(answer.error, sent);
    else await accept(answer, sent, commits);
  }
  busy = false;
}

// Shows another machine. Changes that were not accepted are forgotten.
function load(text) {
  state.text = text;
  changes.clear();
  commit = true;
  return send();
}

function fail(message, sent) {
  status.className = 'verdict state failed';
  status.textContent = message;
  document.body.classList.add('outdated');
  for (const [path] of sent) controls.get(path)?.field.setAttribute('aria-invalid', 'true');
}

async function accept(answer, sent, commits) {
  for (const [path, value] of sent) if (changes.get(path) === value) changes.delete(path);
  Object.assign(state, answer);
  document.body.classList.remove('outdated');
  refreshFields();
  showPage(new DOMParser().parseFromString(answer.page, 'text/html'));
  await putInAddress(commits);
}

// ---- the page

// Takes the sections of the new page. The viewer goes on moving, and opened parts stay open.
function showPage(fresh) {
  const opened = [...document.querySelectorAll('main details[open] > summary')].map(summary => summary.textContent);
  const main = document.querySelector('main'), motion = document.getElementById('motion');
  const viewer = fresh.querySelector('.viewer');
  const [summary, ...others] = [...fresh.querySelector('main').children].filter(section => section.id !== 'motion');
  for (const section of [...main.children]) if (section !== motion && section !== curves) section.remove();
  main.prepend(summary);
  main.append(...others);
  for (const each of main.querySelectorAll('details > summary')) each.parentNode.open = opened.includes(each.textContent);
  for (const button of main.querySelectorAll('button.all')) button.onclick = () =>
    button.setAttribute('aria-pressed', button.nextElementSibling.classList.toggle('every'));
  if (viewer && motion) motion.querySelector('.viewer').show(JSON.parse(viewer.querySelector('script').textContent));
  document.title = fresh.title;
  document.querySelector('h1').textContent = fresh.querySelector('h1').textContent;
  showStatus();
  showCurves();
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
  const all = series.flatMap(one => one.values), low = Math.min(0, ...all), high = Math.max(0, ...all);
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
document.querySelector('header').after(live);
document.querySelector('.sub').textContent = state.name + ', as changed on this page';
// What moves stands at the top, below the summary.
document.getElementById('summary').after(...[document.getElementById('motion'), curves].filter(Boolean));
addFields();
showStatus();
showCurves();
window.onpopstate = async () => load(await textOfAddress());
if (location.hash.length > 1) textOfAddress().then(load, () => fail('the address holds no machine', []));
