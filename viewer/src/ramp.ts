// Colours of a scale from low to high, told apart from both grounds.

const RAMP = ["#3b6fd4", "#8a4fbf", "#d0488f", "#f0704a", "#f5b800"];

/** A colour from low (0) to high (1). */
export function ramp(share: number): string {
  const at = Math.min(1, Math.max(0, share)) * (RAMP.length - 1);
  const below = Math.min(RAMP.length - 2, Math.floor(at));
  const parts = [1, 3, 5].map((i) => {
    const [a, b] = [RAMP[below], RAMP[below + 1]].map((hex) => parseInt(hex.slice(i, i + 2), 16));
    return Math.round(a + (at - below) * (b - a));
  });
  return "#" + parts.map((part) => part.toString(16).padStart(2, "0")).join("");
}

export function rampStops(): string {
  return RAMP.join(", ");
}
