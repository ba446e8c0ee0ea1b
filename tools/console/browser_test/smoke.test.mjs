// A walk through all views, on the map of a simulated drive: what each shows, that nothing keeps anybody out of it, and
// an edit that is taken back. Its screenshots are those of docs/console.md.
import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { checkAccessible, closeBrowser, copyOfMap, goTo, open, run, shot, startConsole } from './harness.mjs';

after(closeBrowser);

test('a person looks at every view, removes a closure and takes that back', async (t) => {
  const folder = copyOfMap(t, 'drive');
  // No daemon serves the folder: the console starts one, and ends it.
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);

  // Map: the key is out of the address, the picture is drawn, the caller is known.
  await page.waitForFunction(() => window.relmapMap?.complete && window.relmapMap.vertices > 0);
  assert.doesNotMatch(page.url(), /key=/);
  await page.getByText('local (operator)').waitFor();
  await shot(page, 'map');
  await checkAccessible(page, 'map');

  await goTo(page, 'Review');
  await page.getByRole('heading', { name: /^Closure \d+:\d+\/\d+$/ }).waitFor();
  await page.getByText(/points of \d+ matched agree/).waitFor();
  await shot(page, 'review');
  await checkAccessible(page, 'review');
  const hash = await run('relmap', ['--server', folder, '--json', 'edges', '--loops']);

  // Removed with a note, after what else would go was shown; then taken back.
  await page.getByRole('button', { name: /^Remove/ }).first().click();
  const dialog = page.getByRole('dialog');
  await dialog.getByLabel('It alone').check();
  await dialog.getByLabel(/^Note/).fill('only a test');
  await dialog.getByText('No other closure comes into force').waitFor();
  await shot(page, 'review-remove');
  await checkAccessible(page, 'dialog');
  await dialog.getByRole('button', { name: /^Remove/ }).click();
  await page.getByText('Your edits in this tab (1)').waitFor();
  await page.keyboard.press('z');
  await dialog.getByRole('button', { name: /^Undo/ }).click();
  await page.getByText('undone').waitFor();
  const states = (text) => JSON.parse(text.trim().split('\n')[0]).edges.map((each) => [JSON.stringify(each.id), each.state]);
  assert.deepEqual(states(await run('relmap', ['--server', folder, '--json', 'edges', '--loops'])), states(hash));

  await goTo(page, 'Place & route');
  await page.getByLabel('Or a frame of the map').fill('1:5');
  await page.getByRole('button', { name: 'Find', exact: true }).click();
  await page.getByText(/Probability that the map does not hold the place/).waitFor();
  await shot(page, 'place');
  await checkAccessible(page, 'place');
  await page.getByRole('navigation', { name: 'What to find' }).getByRole('link', { name: /route/i }).click();
  await page.getByLabel('From', { exact: true }).fill('1:2');
  await page.getByLabel('To: what it is').selectOption('label');
  await page.getByLabel('To', { exact: true }).fill('fountain');
  await page.getByRole('button', { name: 'Find the route' }).click();
  await page.getByRole('img', { name: /uncertain|certain|deviation/i }).first().waitFor();
  await shot(page, 'route');
  await checkAccessible(page, 'route');

  for (const [title, name] of [
    ['Fleet', 'fleet'],
    ['Health', 'health'],
    ['Sessions', 'sessions'],
    ['Labels', 'labels'],
    ['Jobs', 'jobs'],
    ['Audit', 'audit'],
  ]) {
    await goTo(page, title);
    await page.getByRole('heading', { name: title, level: 1 }).waitFor();
    await page.waitForTimeout(700);
    await shot(page, name);
    await checkAccessible(page, name);
  }
  await page.getByText('Map.SetEdgeState').first().waitFor();

  // The same in the dark, and narrow.
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.setViewportSize({ width: 480, height: 860 });
  for (const title of ['Map', 'Review', 'Health']) {
    await goTo(page, title);
    await page.waitForTimeout(700);
    await checkAccessible(page, `${title}, dark and narrow`);
  }
  await page.setViewportSize({ width: 1400, height: 860 });
  await goTo(page, 'Map');
  await page.waitForFunction(() => window.relmapMap?.complete);
  await shot(page, 'map-dark');

  assert.equal(await console.stop(), 0, console.said());
});
