// One flight on the page: its name and outcome, its view, the cards of its UAS, its curves.

import { Cards } from "./cards";
import type { TimeCanvas } from "./chart";
import { curves } from "./curves";
import { difference } from "./difference";
import { element } from "./dom";
import { type Flight, type Mark, words } from "./flight";
import { MapView } from "./map";
import { ProfileChart } from "./profile";
import { rampStops } from "./ramp";
import { SceneView, webgl } from "./scene";
import { TRAILS, type Trail } from "./trail";
import type { Pose, View } from "./view";

export interface PanelEvents {
  seek(time: number): void;
  follow(uas: number | null): void;
  invalidate(): void;
  /** A hand has moved this panel's camera. */
  moved(panel: Panel, pose: Pose): void;
  /** The graphics card has gone. */
  lost(): void;
}

export class Panel {
  readonly element: HTMLElement;
  readonly stage = element("div", { class: "stage" });
  private readonly sceneCanvas = element("canvas", { class: "scene", "aria-label": "3D scene" });
  private readonly scene: SceneView | null;
  private readonly map: MapView;
  private view: View;
  private readonly cards: Cards;
  private readonly charts: TimeCanvas[];
  /** Another flight of the same mission. */
  readonly other: Flight | null;
  private readonly now = element("ul", { class: "now", "aria-live": "polite", "aria-label": "Now" });
  private readonly legend = element("div", { class: "legend" });
  private readonly beside = element("p", { class: "beside" });
  private shownNow = "";

  constructor(
    readonly flight: Flight,
    all: Flight[],
    duration: number,
    private readonly events: PanelEvents,
  ) {
    const mapCanvas = element("canvas", { class: "map", "aria-label": "Map, north up" });
    const context = webgl(this.sceneCanvas);
    this.scene =
      context &&
      new SceneView(this.sceneCanvas, context, flight, (pose) => {
        if (pose) events.moved(this, pose);
        events.invalidate();
      });
    this.sceneCanvas.addEventListener("webglcontextlost", () => events.lost());
    this.map = new MapView(mapCanvas, flight);
    this.view = this.scene ?? this.map;
    this.cards = new Cards(flight, (i) => events.follow(i));
    const profile = new ProfileChart(flight, all, duration, events.seek);
    const beside = curves(flight, all, duration, events.seek);
    this.charts = [profile, ...beside];
    this.legend.hidden = true;
    this.other = all.find((each) => each !== flight && each.sameMission(flight)) ?? null;
    this.beside.hidden = this.other === null;
    this.stage.append(this.sceneCanvas, mapCanvas, this.beside, this.now, this.legend);
    this.element = element(
      "section",
      { class: "flight" },
      element("header", {}, element("h1", {}, title(flight)), element("p", {}, outcome(flight))),
      this.stage,
      element("div", { class: "below" }, profile.canvas),
      element(
        "div",
        { class: "side", "data-title": title(flight) },
        this.cards.element,
        ...this.violations(),
        ...this.marks(),
        element("div", { class: "charts" }, ...beside.map((chart) => chart.canvas)),
      ),
    );
    this.show(this.has3d);
  }

  get has3d(): boolean {
    return this.scene !== null;
  }

  /** The 3D scene, or the map. */
  show(threeD: boolean): void {
    this.view = threeD && this.scene ? this.scene : this.map;
    this.sceneCanvas.hidden = this.view !== this.scene;
    this.map.canvas.hidden = this.view !== this.map;
  }

  resize(): void {
    this.view.resize();
    for (const chart of this.charts) chart.resize();
  }

  repaint(): void {
    this.scene?.repaint();
    this.cards.repaint();
    for (const chart of this.charts) chart.resize();
  }

  draw(time: number, followed: number | null): void {
    const moment = this.flight.moment(time);
    const uas = followed !== null && followed < this.flight.uas ? followed : null;
    for (const view of [this.scene, this.map]) view?.follow(uas);
    this.view.draw(moment, time);
    if (this.other) this.beside.textContent = difference(this.flight, this.other, time);
    this.cards.draw(moment, uas);
    for (const chart of this.charts) {
      chart.focus(uas);
      chart.draw(moment.time);
    }
    this.say(this.flight.at(time));
  }

  /** What is going on now, each with its reason. */
  private say(marks: Mark[]): void {
    const shown = marks.map(({ text }) => text).join("\n");
    if (shown === this.shownNow) return;
    this.shownNow = shown;
    this.now.replaceChildren(...marks.map(({ kind, text }) => element("li", { class: kindOf(kind) }, text)));
  }

  /** Show the other flight in this scene, too. */
  together(on: boolean): void {
    for (const view of [this.scene, this.map]) view?.setGhost(on ? this.other : null);
  }

  setTrail(trail: Trail): void {
    for (const view of [this.scene, this.map]) view?.setTrail(trail);
    const [, words, unit, digits] = TRAILS.find(([kind]) => kind === trail.kind)!;
    this.legend.hidden = trail.kind === "uas";
    const bar = element("i");
    bar.style.background = `linear-gradient(to right, ${rampStops()})`;
    const [low, high] = [trail.low, trail.high].map((value) => value.toFixed(digits));
    this.legend.replaceChildren(`${words.replace("by ", "")}: ${low}`, bar, `${high} ${unit}`);
  }

  overview(): void {
    this.scene?.overview();
  }

  top(): void {
    this.scene?.top();
  }

  take(pose: Pose): void {
    this.scene?.take(pose);
  }

  private violations(): HTMLElement[] {
    const list = this.flight.data.violations.map((violation) => {
      const button = element("button", { type: "button" }, `${violation.t_s} s: ${words(violation)}`);
      button.addEventListener("click", () => this.events.seek(violation.t_s));
      return element("li", {}, button);
    });
    return list.length === 0 ? [] : [element("ul", { class: "violations" }, ...list)];
  }

  /** All else that happened, in a list that opens. */
  private marks(): HTMLElement[] {
    const { marks } = this.flight.data;
    if (marks.length === 0) return [];
    const list = marks.map((mark) => {
      const button = element("button", { type: "button", class: kindOf(mark.kind) }, timed(mark));
      button.addEventListener("click", () => this.events.seek(mark.t_s));
      return element("li", {}, button);
    });
    const counts = new Map<string, number>();
    for (const { kind } of marks) counts.set(kind, (counts.get(kind) ?? 0) + 1);
    const summary = [...counts].map(([kind, n]) => `${n} × ${kind}`).join(", ");
    return [
      element(
        "details",
        { class: "marks" },
        element("summary", {}, summary),
        element("ul", {}, ...list),
      ),
    ];
  }
}

function title(flight: Flight): string {
  return `${flight.scene.name} · ${flight.data.planner}`;
}

function outcome(flight: Flight): string {
  const { summary, covered, violations } = flight.data;
  const count = violations.length;
  const { seed, dynamics } = flight.data;
  return [
    `${covered.at(-1)} of ${flight.scene.waypoints.length} waypoints`,
    `${summary.steps} steps`,
    summary.all_home ? "all home" : "not all home",
    `${summary.energy_Wh.toFixed(2)} Wh`,
    count === 0 ? "no violation" : `${count} violation${count === 1 ? "" : "s"}`,
    `${summary.breaches || "no"} breach${summary.breaches === 1 ? "" : "es"}`,
    `seed ${seed}, ${dynamics}`,
  ].join(" · ");
}

/** A kind of mark as a class of the style. */
export function kindOf(kind: string): string {
  return `mark ${kind.replaceAll(" ", "-")}`;
}

export function timed({ t_s, until_s, text }: Mark): string {
  return `${t_s}${until_s > t_s ? ` to ${until_s}` : ""} s: ${text}`;
}
