import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { idOf, runbookPage } from '../runbook.mjs';
import { Reason } from '../src/proto/relmap/v1/reason_pb';

const page = runbookPage(readFileSync('../../../docs/runbook.md', 'utf8'));

test('every reason and every alert has its paragraph, by its name', () => {
  const alerts = [...readFileSync('../../ops/alerts.yml', 'utf8').matchAll(/- alert: (\w+)/g)].map((match) => match[1]!);
  assert.ok(alerts.length > 10);
  for (const name of [...alerts, ...Object.values(Reason).filter((value) => typeof value === 'string')])
    assert.equal(page.split(`id="${name}"`).length, 2, name);
});

test('the page has no scripts and no styles of its own', () => {
  assert.doesNotMatch(page, /<script|style=|<style|\son\w+=|javascript:/i);
});

test('raw HTML and strange links are shown as text', () => {
  const html = runbookPage('# A\n\n<script>alert(1)</script>\n\nx <img src=x onerror=alert(1)> [y](javascript:alert(1)) [z](security.md) `<b>` [w](https://a.b/?"x)\n\n### `<i>`\n');
  assert.doesNotMatch(html, /<script|<img|<i>|<b>|href="javascript|security\.md/);
  assert.ok(html.includes('&#60;script&#62;'), html);
  assert.ok(html.includes('https://a.b/?'));
});

test('ids of headings', () => {
  assert.equal(idOf('DISK_FULL'), 'DISK_FULL');
  assert.equal(idOf('Where to look first'), 'where-to-look-first');
});
