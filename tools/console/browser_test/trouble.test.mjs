// What goes wrong beside the page: the daemon dies and comes back, a token expires or is of a reader, names are hostile.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { readFileSync, writeFileSync } from 'node:fs';
import { after, test } from 'node:test';
import { closeBrowser, copyOfMap, goTo, maps, open, run, shot, startConsole, startDaemon, temporaryFolder } from './harness.mjs';

after(closeBrowser);

test('a daemon that is killed is told of, and the page goes on when it is back', async (t) => {
  const folder = copyOfMap(t, 'drive');
  const daemon = await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  await page.waitForFunction(() => window.relmapMap?.complete);
  await daemon.stop('SIGKILL');
  await page.getByText('daemon away').waitFor();
  await shot(page, 'daemon-away');
  await goTo(page, 'Labels');
  await startDaemon(t, folder);
  await page.getByText('live', { exact: true }).waitFor();
  await page.getByText('fountain').first().waitFor();
});

// A name of as many bytes as the daemon takes.
const longest = (text) => text + 'W'.repeat(64 - Buffer.byteLength(text));
const markup = longest('<img src=x onerror="document.title=\'owned\';alert(1)">');
const reversed = longest('abc\u202Edlrow\u2066\u200B<script>alert(2)</script>');

async function checkHarmless(page, what) {
  assert.equal(await page.locator('img[src="x"]').count(), 0, what);
  assert.equal(await page.locator('body script').count(), 0, what);
  assert.doesNotMatch(await page.title(), /owned/, what);
  // What reverses the order of letters, and what cannot be seen, is written as its code.
  assert.doesNotMatch(await page.evaluate(() => document.body.innerText), /[\u202a-\u202e\u2066-\u2069\u200b]/, what);
  const named = await page.evaluate(() =>
    [...document.querySelectorAll('[title], [aria-label]')].flatMap((each) => [each.getAttribute('title'), each.getAttribute('aria-label')]).join(' '));
  assert.doesNotMatch(named, /[\u202a-\u202e\u2066-\u2069\u200b]/, what);
  // Nothing reaches beyond the page's right edge.
  const [width, seen] = await page.evaluate(() => [document.querySelector('main').scrollWidth, document.querySelector('main').clientWidth]);
  assert.ok(width <= seen + 1, `${what}: ${width} of ${seen} pixels`);
}

test('names of others are drawn as text, however hostile', async (t) => {
  const folder = copyOfMap(t, 'drive');
  await startDaemon(t, folder);
  await run('relmap-frontend', ['--source', 'sim', join(maps, 'recording'), '--robot', markup, '--session', reversed, '--server', folder,
    '--spool', join(temporaryFolder(t), 'spool'), '--rate', 'max', '--quiet']);
  for (const [frame, label] of [['1:10', markup], ['1:12', reversed], ['1:12', longest('W')], ['1:14', longest('\u05d0\u05d1 ')]])
    await run('relmap', ['--server', folder, 'label', frame, label]);
  const { edges } = JSON.parse((await run('relmap', ['--server', folder, '--json', 'edges', '--loops'])).trim().split('\n')[0]);
  const { frame: { session, index }, ordinal } = edges[0].id;
  const edge = `${session}:${index}/${ordinal}`;
  const note = `${markup} ${reversed} `.repeat(20).slice(0, 960);
  await run('relmap', ['--server', folder, 'edge', 'remove', '--only-this', edge, '--note', note]);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  const errors = [];
  page.on('console', (message) => message.type() === 'error' && !/Failed to load resource/.test(message.text()) && errors.push(message.text()));

  await page.waitForFunction(() => window.relmapMap?.complete);
  for (const width of [1400, 480]) {
    await page.setViewportSize({ width, height: 860 });
    for (const [view, address, text] of [
      ['map', '#/map?frame=1:10', /img src=x onerror/],
      ['map', `#/map?robot=${encodeURIComponent(reversed)}`, 'The robot abc'],
      ['review', `#/review?states=all&edge=${edge}`, '<img src=x'],
      ['place', `#/place?tab=route&from=1:2&to=${encodeURIComponent('label:' + markup)}`, / of driving, /],
      ['fleet', '#/fleet', /img src=x onerror/],
      ['sessions', '#/sessions', /img src=x onerror/],
      ['sessions', '#/sessions?show=matrix', /abc\\u202edlrow/],
      ['labels', '#/labels', markup],
      ['audit', '#/audit', /img src=x/],
    ]) {
      await page.goto(new URL(address, page.url()).href);
      await page.getByText(text).first().waitFor({ state: 'attached' });
      await page.waitForTimeout(400);
      const what = `${address} at ${width}`;
      await shot(page, `hostile-${view}${address.includes('matrix') ? '-matrix' : ''}-${width}`);
      await checkHarmless(page, what);
    }
  }
  await page.setViewportSize({ width: 1400, height: 860 });
  await goTo(page, 'Sessions');
  await page.getByRole('row', { name: /img src/ }).getByRole('button', { name: /Delete/ }).click();
  await page.getByRole('dialog').getByText(/img src=x/).first().waitFor();
  await shot(page, 'hostile-delete');
  await checkHarmless(page, 'the dialog');
  assert.deepEqual(errors, []);
});

// A message of protobuf: fields of numbers and texts.
function message(fields) {
  const varint = (value) => (value < 128 ? [value] : [(value & 127) | 128, ...varint(Math.floor(value / 128))]);
  return Buffer.concat(Object.entries(fields).map(([field, value]) => {
    if (typeof value === 'number') return Buffer.from([...varint(field * 8), ...varint(value)]);
    const bytes = Buffer.from(value);
    return Buffer.concat([Buffer.from([...varint(field * 8 + 2), ...varint(bytes.length)]), bytes]);
  }));
}
function frame(flags, bytes) {
  const head = Buffer.alloc(5);
  head[0] = flags;
  head.writeUInt32BE(bytes.length, 1);
  return Buffer.concat([head, bytes]);
}

test('an answer with names of a megabyte is shown, cut, and the page goes on', async (t) => {
  const console = await startConsole(t, copyOfMap(t, 'drive'));
  const page = await open(t, console.value);
  await page.waitForFunction(() => window.relmapMap?.complete);
  const huge = '<b>\u202e\u0007'.repeat(130_000);
  const session = message({ 1: 1, 2: 'u', 3: huge, 4: huge, 8: 75, 9: 76 });
  await page.route('**/relmap.v1.Map/ListSessions', (route) =>
    route.fulfill({
      contentType: 'application/grpc-web+proto',
      body: Buffer.concat([frame(0, message({ 1: session })), frame(0x80, Buffer.from('grpc-status: 0\r\n'))]),
    }));
  await page.reload();
  for (const view of ['Map', 'Sessions']) {
    await goTo(page, view);
    await page.getByText('<b>\\u202e\\u0007').first().waitFor();
    assert.ok((await page.evaluate(() => document.body.innerText.length)) < 20_000);
    await checkHarmless(page, view);
    await shot(page, `huge-${view.toLowerCase()}`);
  }
  await goTo(page, 'Labels');
  await page.getByText('fountain').first().waitFor();
});

// A daemon that is reached over TLS, with credentials; the console before it. `issue` gives out tokens.
async function guarded(t, map) {
  const folder = copyOfMap(t, map);
  const credentials = join(temporaryFolder(t), 'credentials');
  await run('relmap-admin', ['credentials', 'ca', credentials, '--host', '127.0.0.1']);
  const issue = async (name, role) => {
    const file = join(credentials, `${name}.pem`);
    await run('relmap-admin', ['credentials', 'new', credentials, name, '--role', role, '--token', '--out', file]);
    const [, body] = /BEGIN RELMAP TOKEN-----([^-]*)-----/.exec(readFileSync(file, 'utf8'));
    return Buffer.from(body, 'base64').toString();
  };
  const port = 20000 + Math.floor(Math.random() * 20000);
  await startDaemon(t, folder, ['--listen', `127.0.0.1:${port}`, '--credentials', credentials]);
  return { folder, credentials, issue, server: `127.0.0.1:${port}`, arguments: ['--credentials', join(credentials, 'ca.crt')] };
}

async function login(page, token) {
  await page.getByLabel('Token', { exact: true }).fill(token);
  await page.getByRole('button', { name: 'Log in' }).click();
}

test('a reader sees everything, and is offered no edit; a revoked token asks for another', async (t) => {
  const daemon = await guarded(t, 'drive');
  const token = await daemon.issue('dashboard', 'reader');
  const console = await startConsole(t, daemon.server, daemon.arguments);
  const page = await open(t, console.value);
  await shot(page, 'login');
  await login(page, 'not a token');
  await page.getByText('The login failed.').waitFor();
  await login(page, token);
  await page.getByText('dashboard (reader)').waitFor();
  await page.waitForFunction(() => window.relmapMap?.complete && window.relmapMap.vertices > 0);
  await goTo(page, 'Review');
  await page.getByText('closures are edited by operators').waitFor();
  assert.equal(await page.getByRole('button', { name: /^Remove/ }).count(), 0);
  await run('relmap-admin', ['credentials', 'revoke', daemon.credentials, 'dashboard']);
  await page.getByText('You have to log in again.').waitFor();
});

test('a token that expires while it is used asks for another, and the page goes on where it was', async (t) => {
  const daemon = await guarded(t, 'drive');
  const [first, second] = [await daemon.issue('anna', 'operator'), await daemon.issue('ben', 'operator')];
  const console = await startConsole(t, daemon.server, daemon.arguments);
  const page = await open(t, console.value);
  await login(page, first);
  await goTo(page, 'Labels');
  await page.getByText('fountain').first().waitFor();
  // The list of who may call has the time at which each may no more.
  const list = join(daemon.credentials, 'access');
  const soon = new Date(Date.now() + 4000).toISOString().replace(/\.\d+/, '');
  writeFileSync(list, readFileSync(list, 'utf8').replace(/\S+Z( valid anna)/, `${soon}$1`));
  await page.getByText('You have to log in again.').waitFor();
  assert.ok(Date.now() > Date.parse(soon));
  await page.getByText(/expired/).first().waitFor();
  await shot(page, 'expired');
  await login(page, first);
  await page.getByText('The login failed.').waitFor();
  await login(page, second);
  await page.getByText('ben (operator)').waitFor();
  await page.getByRole('heading', { name: 'Labels', level: 1 }).waitFor();
  await page.getByText('fountain').first().waitFor();
  await page.getByText('live', { exact: true }).waitFor();
});

test('whoever looks at a closure is told who removes it meanwhile, and why', async (t) => {
  const daemon = await guarded(t, 'planted');
  const [first, second] = [await daemon.issue('anna', 'operator'), await daemon.issue('ben', 'operator')];
  const console = await startConsole(t, daemon.server, daemon.arguments);
  const [anna, ben] = [await open(t, console.value), await open(t, console.value)];
  await login(anna, first);
  await login(ben, second);
  for (const page of [anna, ben]) {
    await goTo(page, 'Review');
    await page.getByRole('heading', { name: /^Closure / }).waitFor();
  }
  const name = await anna.locator('h2 .mono').first().innerText();
  assert.equal(await ben.locator('h2 .mono').first().innerText(), name);
  // Ben is about to remove it, too.
  await ben.getByRole('button', { name: /^Remove/ }).first().click();
  await ben.getByRole('dialog').getByText(/Note, for the history/).waitFor();
  await anna.getByRole('button', { name: /^Remove/ }).first().click();
  await anna.getByRole('dialog').getByLabel(/^Note/).fill('that is\nthe other hall');
  await anna.getByRole('dialog').getByRole('button', { name: /^Remove/ }).click();
  await anna.getByText('Your edits in this tab (1)').waitFor();
  const told = ben.locator('p[role=status]').filter({ hasText: 'changed it: it is now removed' });
  await told.waitFor();
  assert.match((await told.innerText()).replace(/\s+/g, ' '), /anna changed it: it is now removed, “that is the other hall”/);
  // What he was about to do is refused, and nothing is done twice.
  await ben.getByRole('dialog').getByRole('button', { name: /^Remove/ }).click();
  await ben.getByRole('dialog').getByRole('alert').first().waitFor();
  await shot(ben, 'review-conflict');
  await ben.keyboard.press('Escape');
  assert.equal(await ben.getByText('Your edits in this tab (0)').count(), 1);
});
