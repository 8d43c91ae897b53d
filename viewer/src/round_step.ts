/** The largest of 1, 2, 5, 10, 20, ... (times any power of ten) that is not above `most`. */
export function roundStep(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most) + 1e-9);
  return power * [5, 2, 1].find((factor) => factor * power <= most * (1 + 1e-9))!;
}
