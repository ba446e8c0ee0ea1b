// What the tests stand on: a daemon on a copy of a map, a console before it, a page in a browser.
import { spawn } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { basename, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import assert from 'node:assert/strict';

const root = resolve(fileURLToPath(import.meta.url), '../../../..');
const require = createRequire(join(root, 'tools/console/page/'));
const { chromium } = require('playwright-core');
const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

export const bin = (name) => join(root, 'build/release/bin', name);
export const maps = join(root, 'build/console-test');
export const shots = resolve(root, process.env.RELMAP_SHOTS ?? 'build/console-test/shots');
// However busy the machine is.
export const patience = Number(process.env.RELMAP_PATIENCE_MS ?? 600_000);

export function temporaryFolder(test) {
  const folder = mkdtempSync(join(tmpdir(), 'relmap-console-test-'));
  test.after(() => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

// A copy of one of the maps that make_maps made.
export function copyOfMap(test, name) {
  const folder = join(temporaryFolder(test), 'map');
  // Without what belongs to the daemon that made it.
  const own = (file) => !['socket', 'endpoint'].includes(basename(file));
  cpSync(join(maps, name), folder, { recursive: true, filter: own });
  return folder;
}

// A program that runs until the test ends. `ready` is called with each line of its output until it returns something.
export async function start(test, program, args, ready, options = {}) {
  const child = spawn(bin(program), args, { stdio: ['ignore', 'pipe', 'pipe'], ...options });
  let said = '';
  const ended = new Promise((done) => child.once('exit', (code, signal) => done(code ?? signal)));
  const running = {
    child,
    ended,
    said: () => said,
    async stop(signal = 'SIGTERM') {
      child.kill(signal);
      return ended;
    },
  };
  test.after(async () => {
    if (child.exitCode === null && child.signalCode === null) await running.stop('SIGKILL');
  });
  running.value = await new Promise((done, fail) => {
    let held = '';
    const read = (bytes) => {
      said += bytes;
      held += bytes;
      const lines = held.split('\n');
      held = lines.pop();
      for (const line of lines) {
        const value = ready(line);
        if (value !== undefined) done(value);
      }
    };
    child.stdout.on('data', read);
    child.stderr.on('data', read);
    child.once('exit', (code) => fail(new Error(`${program} ended with ${code}: ${said}`)));
    child.once('error', fail);
  });
  return running;
}

export function startDaemon(test, folder, args = []) {
  return start(test, 'relmapd', ['--data', folder, ...args], (line) => (/ serves .* at /.test(line) ? true : undefined));
}

// value: the address to open, with the key where one is needed.
export function startConsole(test, server, args = []) {
  const cache = args.includes('--cache') ? [] : ['--cache', temporaryFolder(test)];
  return start(test, 'relmap-console', [server, '--listen', '127.0.0.1:0', ...cache, ...args],
    (line) => /(https?:\/\/\S+)/.exec(line)?.[1]);
}

// Runs a program to its end and returns what it wrote on stdout.
export async function run(program, args) {
  const child = spawn(bin(program), args, { stdio: ['ignore', 'pipe', 'pipe'] });
  let out = '', errors = '';
  child.stdout.on('data', (bytes) => (out += bytes));
  child.stderr.on('data', (bytes) => (errors += bytes));
  const code = await new Promise((done) => child.once('close', done));
  assert.equal(code, 0, `${program} ${args.join(' ')}: ${errors}`);
  return out;
}

const drawing = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const notDrawing = ['--disable-gpu', '--disable-webgl', '--disable-webgl2', '--disable-3d-apis'];
const browsers = new Map();
// A page of a new visitor. It fails the test if the page throws, breaks its own security policy, or opens a dialog of
// the browser. `moving`: what moves is eased; `webgl` false: a browser that draws no map.
export async function open(test, address, { width = 1400, height = 860, dark = false, moving = false, touch = false, webgl = true } = {}) {
  if (!browsers.has(webgl))
    browsers.set(webgl, chromium.launch({
      executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
      args: [...(webgl ? drawing : notDrawing), '--no-sandbox', '--disable-dev-shm-usage'],
    }));
  const browser = await browsers.get(webgl);
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: dark ? 'dark' : 'light',
    reducedMotion: moving ? 'no-preference' : 'reduce',
    hasTouch: touch,
    ignoreHTTPSErrors: true,
  });
  const page = await context.newPage();
  page.setDefaultTimeout(patience);
  const wrong = [];
  page.on('pageerror', (error) => wrong.push(String(error)));
  page.on('console', (message) => {
    if (/Content Security Policy/.test(message.text())) wrong.push(message.text());
  });
  page.on('dialog', (dialog) => {
    wrong.push(`a dialog: ${dialog.message()}`);
    void dialog.dismiss();
  });
  test.after(async () => {
    await context.close();
    assert.deepEqual(wrong, []);
  });
  await page.goto(address);
  return page;
}
// Called once all tests of a file are done.
export async function closeBrowser() {
  for (const browser of browsers.values()) await (await browser).close();
  browsers.clear();
}

// Goes to a view by the bar, as a person does.
export async function goTo(page, title) {
  await page.getByRole('navigation', { name: 'Views' }).getByRole('link', { name: title, exact: true }).click();
}

export async function shot(page, name) {
  mkdirSync(shots, { recursive: true });
  await page.screenshot({ path: join(shots, `${name}.jpg`), type: 'jpeg', quality: 82 });
}

// Fails on what keeps people with a keyboard, a screen reader or weak eyes out.
export async function checkAccessible(page, what) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  const found = violations.map((each) => `${each.id}: ${each.help}: ${each.nodes.map((node) => node.html.slice(0, 120)).join(' | ')}`);
  assert.deepEqual(found, [], what);
}

export function planted() {
  const file = join(maps, 'planted.txt');
  assert.ok(existsSync(file));
  return readFileSync(file, 'utf8').trim().split('\n');
}
