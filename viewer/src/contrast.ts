// Colours in numbers: how well words in one are read on another.

/** Least contrast of words (WCAG 2.2, level AA). */
export const LEGIBLE = 4.5;

/** A colour, nearer to black (0) or white (255) until words in it are read well on a ground. */
export function readOn(ground: string, hex: string, towards: number): string {
  let value = hex;
  while (contrast(value, ground) < LEGIBLE) value = mixed(value, towards, 0.08);
  return value;
}

/** Ratio of contrast of two colours, 1 to 21 (WCAG 2.2). */
export function contrast(a: string, b: string): number {
  const [low, high] = [a, b].map(luminance).sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

function luminance(hex: string): number {
  const [red, green, blue] = [1, 3, 5].map((i) => {
    const part = parseInt(hex.slice(i, i + 2), 16) / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

/** A colour, by a share nearer to black (0) or white (255). */
export function mixed(hex: string, towards: number, share: number): string {
  const parts = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const result = parts.map((part) => Math.round(part + share * (towards - part)));
  return "#" + result.map((part) => part.toString(16).padStart(2, "0")).join("");
}
