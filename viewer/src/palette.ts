// Colours: those of the page are custom properties, light and dark, that uas_coverage_env/draw/
// colours.py writes into it; those of things on the map come with the flight and are fitted to the dark ground here.

import { mixed, readOn } from "./contrast";
import { LITTLE_SPARE } from "./flight";

const DARK = matchMedia("(prefers-color-scheme: dark)");

const known = new Map<string, string>();

export function isDark(): boolean {
  return DARK.matches;
}

/** Call back on light and dark, until the signal. */
export function onThemeChange(changed: () => void, signal: AbortSignal): void {
  const forget = () => {
    known.clear();
    changed();
  };
  DARK.addEventListener("change", forget, { signal });
}

/** A custom property of the style, as "--ink". */
export function colour(name: string): string {
  let value = known.get(name);
  if (value === undefined) {
    value = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    known.set(name, value);
  }
  return value;
}

/** The colour of a line or mark: lighter on the dark ground. */
export function bright(hex: string): string {
  if (!isDark()) return hex;
  const light = [1, 3, 5].reduce((sum, i) => sum + parseInt(hex.slice(i, i + 2), 16), 0);
  return mixed(hex, 255, light < 200 ? 0.65 : 0.3);
}

/** The colour of words in that of a line: nearer to the ink until they are read well (WCAG AA). */
export function legible(hex: string): string {
  const name = `words ${hex}`;
  let value = known.get(name);
  if (value === undefined) {
    value = readOn(colour("--panel"), bright(hex), isDark() ? 255 : 0);
    known.set(name, value);
  }
  return value;
}

/** The colour of a large area: darker on the dark ground. */
export function dim(hex: string): string {
  return isDark() ? mixed(hex, 0, 0.3) : hex;
}

export function darker(hex: string, share: number): string {
  return mixed(hex, 0, share);
}

/** Green: enough charge for the way home with margin; yellow: little more; red: not enough. */
export function ofSpare(spare: number): string {
  return colour(spare > LITTLE_SPARE ? "--charged" : spare > 0 ? "--half" : "--discharged");
}
