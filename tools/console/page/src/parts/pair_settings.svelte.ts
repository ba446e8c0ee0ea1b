// How pairs of pictures are shown. It stays as it is from one pair to the next.
import type { Colour } from '../lib/matches';

export const pairSettings = $state({
  mode: 'beside' as 'beside' | 'over',
  lines: true,
  others: false, // matches that do not agree with the transform
  colour: 'place' as Colour,
  wiped: 50, // percent of the width that shows the frame's picture
});
