// What a person does with the map: routes, two fingers, the time slider, robots that stream, a map that changes, a
// browser that cannot draw.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, test } from 'node:test';
import {
  closeBrowser, copyOfMap, goTo, maps, open, planted, run, shot, start, startConsole, startDaemon, temporaryFolder,
} from './harness.mjs';

after(closeBrowser);

const drawn = () => window.relmapMap?.complete && window.relmapMap.vertices > 0;
const camera = (page) => page.evaluate(() => window.relmapMap.camera);

test('a route is drawn on the map, found again from its address, and cleared', async (t) => {
  const folder = copyOfMap(t, 'planted');
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  await page.waitForFunction(drawn);
  await goTo(page, 'Place & route');
  await page.getByRole('navigation', { name: 'What to find' }).getByRole('link', { name: /route/i }).click();
  await page.getByLabel('From', { exact: true }).fill('1:20');
  await page.getByLabel('To', { exact: true }).fill('1:90');
  await page.getByRole('button', { name: 'Find the route' }).click();
  await page.getByRole('link', { name: 'On the map' }).click();
  const shown = () => window.relmapMap?.complete && window.relmapMap.routePoints > 5;
  await page.waitForFunction(shown);
  const panel = page.getByRole('region', { name: 'Route' });
  await panel.getByText(/ of driving, /).waitFor();
  assert.match(page.url(), /route=1:20,1:90/);
  await shot(page, 'map-route');

  // Whoever opens the address sees the same.
  const other = await open(t, console.value);
  await other.waitForFunction(drawn);
  await other.goto(page.url());
  await other.waitForFunction(shown);
  const [here, there] = [await camera(page), await camera(other)];
  assert.ok(Math.hypot(here.x - there.x, here.y - there.y) < 5 * here.mpp, JSON.stringify([here, there]));

  // Escape lets go of what is selected first, and then of the route.
  await page.goto(`${page.url()}&frame=1:30`);
  await page.getByRole('region', { name: 'Frame 1:30' }).waitFor();
  await page.waitForFunction(shown);
  await page.keyboard.press('Escape');
  await page.getByRole('region', { name: 'Frame 1:30' }).waitFor({ state: 'detached' });
  assert.ok(await panel.isVisible());
  await page.keyboard.press('Escape');
  await page.waitForFunction(() => window.relmapMap.routePoints === 0);
  assert.doesNotMatch(page.url(), /route=/);
  await other.getByRole('button', { name: 'Clear the route' }).click();
  await other.waitForFunction(() => window.relmapMap.routePoints === 0);

  // Ends between which there is no way, or that are none.
  await page.goto(new URL('#/map?route=1:20,99:1', page.url()).href);
  await panel.getByText('There is no route to draw.').waitFor();
});

test('a map that changes while it is open goes over into its new shape', async (t) => {
  const folder = copyOfMap(t, 'planted');
  await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value, { moving: true });
  await page.waitForFunction(drawn);
  await page.goto(new URL('#/map?frame=1:60', page.url()).href);
  await page.getByRole('region', { name: 'Frame 1:60' }).waitFor();
  await page.keyboard.press('0');
  await page.waitForTimeout(1500);
  await shot(page, 'map-before');
  // What each frame of the picture had.
  await page.evaluate(() => {
    window.seen = [];
    const look = () => {
      const { version, ease, frames, vertices, complete } = window.relmapMap;
      if (frames !== window.seen.at(-1)?.frames) window.seen.push({ version, ease, frames, vertices, complete });
      requestAnimationFrame(look);
    };
    look();
  });
  const version = await page.evaluate(() => window.relmapMap.version);
  for (const edge of planted().slice(0, 4)) await run('relmap', ['--server', folder, 'edge', 'remove', edge]);
  // A newer layout may come before the last one is reached.
  await page.waitForFunction(
    (before) => window.seen.filter(({ version, ease }) => version > before && ease === 1).length > 1 &&
      new Set(window.seen.map((each) => each.version)).size > 2,
    version, { polling: 200 });
  await shot(page, 'map-after');
  const seen = await page.evaluate(() => window.seen);
  const versions = [...new Set(seen.map((each) => each.version))];
  assert.ok(versions.length >= 2);
  for (const each of versions.slice(1)) {
    const frames = seen.filter(({ version }) => version === each);
    // It begins where the old layout was, and arrives; nothing is missing meanwhile.
    assert.ok(frames[0].ease < 0.2, JSON.stringify(frames));
    for (let i = 1; i < frames.length; ++i) assert.ok(frames[i].ease >= frames[i - 1].ease);
    assert.ok(frames.every(({ vertices }) => vertices > 0));
  }
  // Whatever was begun is finished, unless something newer takes its place.
  await page.waitForFunction(() => window.relmapMap.ease === 1);
});

test('two fingers move, widen and narrow the picture; one finger pulls it, and taps select', async (t) => {
  const console = await startConsole(t, copyOfMap(t, 'drive'));
  const page = await open(t, console.value, { touch: true, width: 900, height: 700 });
  await page.waitForFunction(drawn);
  const box = await page.getByRole('application').boundingBox();
  const devtools = await page.context().newCDPSession(page);
  const touch = (type, ...points) =>
    devtools.send('Input.dispatchTouchEvent', {
      type, touchPoints: points.map(([x, y], id) => ({ x: box.x + x, y: box.y + y, id })),
    });
  const middle = (now) => ({ x: now.x - (box.width / 2 - 400) * now.mpp, y: now.y + (box.height / 2 - 300) * now.mpp });
  const before = await camera(page);
  const held = middle(before); // what lies at 400, 300
  await touch('touchStart', [350, 300], [450, 300]);
  for (let i = 1; i <= 20; ++i) await touch('touchMove', [350 - 5 * i, 300], [450 + 5 * i, 300]);
  await touch('touchEnd');
  const wide = await camera(page);
  assert.ok(Math.abs(before.mpp / wide.mpp - 3) < 0.1, `${before.mpp} ${wide.mpp}`);
  // What was between the fingers stays between them.
  assert.ok(Math.hypot(middle(wide).x - held.x, middle(wide).y - held.y) < 3 * wide.mpp);
  await page.waitForFunction(drawn);
  await shot(page, 'map-pinched');

  await touch('touchStart', [300, 300]);
  for (let i = 1; i <= 10; ++i) await touch('touchMove', [300 + 6 * i, 300 + 3 * i]);
  await touch('touchEnd');
  const pulled = await camera(page);
  assert.ok(Math.abs((wide.x - pulled.x) / wide.mpp - 60) < 5 && Math.abs((pulled.y - wide.y) / wide.mpp - 30) < 5);

  // A finger that stays down while the other goes does not jump.
  await touch('touchStart', [300, 300], [500, 300]);
  for (let i = 1; i <= 10; ++i) await touch('touchMove', [300 + 4 * i, 300], [500 - 4 * i, 300]);
  await touch('touchEnd');
  const narrow = await camera(page);
  assert.ok(Math.abs(narrow.mpp / pulled.mpp - 200 / 120) < 0.1);

  await page.keyboard.press('0');
  await page.waitForFunction(drawn);
  await page.waitForTimeout(500);
  const at = await page.evaluate(() => window.relmapMap.camera);
  await page.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
  assert.deepEqual(await camera(page), at); // a tap moves nothing
});

test('the time slider plays how the map grew, and stops where it is told to', async (t) => {
  const console = await startConsole(t, copyOfMap(t, 'drive'));
  const page = await open(t, console.value);
  await page.waitForFunction(drawn);
  const slider = page.getByLabel('Shown up to this time');
  const frames = () => page.evaluate(() => window.relmapMap.frames);
  const before = await frames();
  await page.getByRole('button', { name: 'Play how the map grew' }).click();
  const stop = page.getByRole('button', { name: 'Stop' });
  const said = new Set();
  while (said.size < 5) said.add(await slider.getAttribute('aria-valuetext'));
  assert.ok(![...said].includes('now'));
  const times = [...said];
  assert.deepEqual(times, [...times].sort());
  assert.ok((await frames()) > before + 3);
  await shot(page, 'map-playing');
  await stop.click();
  await page.waitForFunction(() => /time=\d/.test(location.hash));
  const stopped = await slider.getAttribute('aria-valuetext');
  await page.waitForTimeout(600);
  assert.equal(await slider.getAttribute('aria-valuetext'), stopped);
  // It goes on from there, and ends with what there is now.
  await page.getByRole('button', { name: 'Play how the map grew' }).click();
  await page.waitForFunction(() => document.querySelector('input[type=range]').getAttribute('aria-valuetext') === 'now');
  await page.getByRole('button', { name: 'Play how the map grew' }).waitFor();
  await page.waitForFunction(() => !/time=/.test(location.hash));
});

test('robots that stream into an empty map appear with their trails, and are followed', async (t) => {
  const folder = join(temporaryFolder(t), 'map');
  await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value, { moving: true });
  await page.getByText('The map is empty.').waitFor();
  await shot(page, 'map-empty');
  const spool = join(temporaryFolder(t), 'spool');
  const robot = await start(t, 'relmap-frontend', [
    '--source', 'sim', join(maps, 'recording'), '--robot', 'cart', '--session', 'morning', '--server', folder, '--spool', spool,
    '--rate', '5',
  ], () => true);
  await page.waitForFunction(() => window.relmapMap?.vertices > 0);
  await page.waitForFunction(() => window.relmapMap.robots > 0 && window.relmapMap.trailPoints > 1);
  await shot(page, 'map-robot');
  const list = page.getByRole('complementary', { name: 'Layers and lists' });
  await list.getByRole('button', { name: /^cart/ }).click();
  await page.getByText('Following cart').waitFor();
  const first = await camera(page);
  await page.waitForFunction((from) => Math.hypot(window.relmapMap.camera.x - from.x, window.relmapMap.camera.y - from.y) > 1, first);
  await shot(page, 'map-following');

  // The fleet has it, and the keys lead to it.
  await goTo(page, 'Fleet');
  await page.getByRole('row', { name: /cart/ }).waitFor();
  await page.keyboard.press('j');
  assert.match(await page.evaluate(() => document.activeElement.innerText), /cart/);
  await page.keyboard.press('Enter');
  await page.getByText('Following cart').waitFor();
  await robot.stop();
});

test('a browser that cannot draw the map says so, and everything else works in it', async (t) => {
  const console = await startConsole(t, copyOfMap(t, 'drive'));
  const page = await open(t, console.value, { webgl: false });
  await page.getByText('The map cannot be drawn in this browser.').waitFor();
  await page.getByText(/no WebGL2/).waitFor();
  assert.equal(await page.evaluate(() => window.relmapMap), undefined);
  await shot(page, 'map-without-webgl');
  await goTo(page, 'Review');
  await page.getByText(/points of \d+ matched agree/).waitFor();
  await goTo(page, 'Labels');
  await page.getByText('fountain').first().waitFor();
  // A link to a frame leads to what is known of it, in words.
  await page.getByRole('row', { name: /fountain/ }).getByRole('link', { name: '1:20' }).click();
  await page.getByRole('region', { name: 'Frame 1:20' }).getByText('fountain').waitFor();
});
