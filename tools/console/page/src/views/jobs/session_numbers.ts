// "3, 5" -> [3, 5]; empty: none, which means all; null: not such a list.
export function parseSessions(text: string): number[] | null {
  const words = text.split(/[\s,;]+/).filter(Boolean);
  const numbers = words.map((word) => (/^[1-9]\d{0,9}$/.test(word) ? Number(word) : NaN));
  if (numbers.some((number) => !(number <= 0xffffffff))) return null;
  return [...new Set(numbers)].sort((a, b) => a - b);
}
