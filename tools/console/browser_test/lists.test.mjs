// The keys that step through the rows of every list, and open one.
import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { closeBrowser, copyOfMap, goTo, open, run, startConsole, startDaemon } from './harness.mjs';

after(closeBrowser);

test('j and k step through labels, sessions, jobs and the audit log, and Enter opens', async (t) => {
  const folder = copyOfMap(t, 'drive');
  await startDaemon(t, folder);
  for (const name of ['door', 'gate']) await run('relmap', ['--server', folder, 'label', '1:30', name]);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  const focused = () => page.evaluate(() => document.activeElement.innerText);

  await goTo(page, 'Labels');
  await page.getByRole('row', { name: /gate/ }).waitFor();
  await page.keyboard.press('j');
  const first = await focused();
  assert.match(first, /door/);
  await page.keyboard.press('j');
  assert.match(await focused(), /fountain/);
  await page.keyboard.press('k');
  assert.equal(await focused(), first);
  await page.keyboard.press('k'); // there is none before it
  assert.equal(await focused(), first);
  // Whoever types, types.
  await page.getByLabel('Find labels').fill('');
  await page.getByLabel('Find labels').press('j');
  assert.equal(await page.getByLabel('Find labels').inputValue(), 'j');
  await page.getByLabel('Find labels').fill('');
  await page.getByRole('row', { name: /gate/ }).waitFor();
  await page.getByRole('heading', { name: 'Labels', level: 1 }).click();
  await page.keyboard.press('k');
  assert.match(await focused(), /gate/);
  await page.keyboard.press('Enter');
  await page.getByRole('region', { name: 'Frame 1:30' }).waitFor();

  await goTo(page, 'Sessions');
  await page.getByRole('row', { name: /drive/ }).waitFor();
  await page.keyboard.press('j');
  await page.keyboard.press('Enter');
  await page.getByRole('heading', { name: 'Map', level: 1 }).waitFor();

  await goTo(page, 'Jobs');
  await page.getByRole('button', { name: 'Verify', exact: true }).click();
  await page.getByText('✓ done').waitFor();
  await page.keyboard.press('j');
  assert.match(await focused(), /Verify of the whole map/);

  await goTo(page, 'Audit');
  await page.getByRole('row', { name: /Map.SetLabel/ }).first().waitFor();
  await page.keyboard.press('j');
  await page.keyboard.press('Enter');
  assert.equal(await page.locator('details[open] summary').filter({ hasText: 'call' }).count(), 1);
});
