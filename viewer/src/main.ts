// The page: reads the flights it was given, and draws them when something has changed.

import { Clock } from "./clock";
import { Controls, type Saved, type ViewChoice } from "./controls";
import { element } from "./dom";
import { Flight, type FlightData } from "./flight";
import { followLive } from "./live";
import { Pace } from "./pace";
import { onThemeChange } from "./palette";
import { Panel } from "./panel";
import { Film, savePicture, saveTable, type Shown } from "./save";
import { Trail, TRAILS, type TrailKind } from "./trail";

const source = document.getElementById("flights")!;
const data: FlightData[] = JSON.parse(source.textContent!);
const flights = data.map((each) => new Flight(each));
const longest = () => Math.max(...flights.map((flight) => flight.duration));

let trailKind: TrailKind = "uas";
let dirty = true;
let described = true;
const invalidate = () => (dirty = true);
const clock = new Clock(longest(), invalidate);
const choice: ViewChoice = { threeD: true, followed: null, together: false };
const pace = new Pace((coarse) => {
  for (const panel of panels) panel.setCoarse(coarse);
  invalidate();
});
const film = new Film(clock, fileName());

const panels = flights.map(
  (flight) =>
    new Panel(flight, flights, {
      seek: (time) => {
        clock.playing = false;
        clock.seek(time);
      },
      follow: (uas) => follow(choice.followed === uas ? null : uas),
      invalidate,
      moved: (from, pose) => panels.forEach((panel) => panel !== from && panel.take(pose)),
      lost: () => show(false),
    }),
);
const has3d = panels.every((panel) => panel.has3d);
const controls = new Controls(clock, flights, choice, has3d, {
  show,
  follow,
  overview: () => frame("overview"),
  top: () => frame("top"),
  trail: colourTrails,
  together,
  save,
  turn: (turn, tilt, nearer) => panels[0].turn(turn, tilt, nearer),
});
controls.sampleTime = Math.min(...data.map((each) => each.dt_s));

const main = element("main", { class: panels.length === 2 ? "two" : "one" });
main.append(...panels.map((panel) => panel.element));
document.body.append(main, controls.element);

function show(threeD: boolean): void {
  choice.threeD = threeD && has3d;
  for (const panel of panels) panel.show(choice.threeD);
  resize();
}

function follow(uas: number | null): void {
  choice.followed = uas;
  invalidate();
}

function frame(how: "overview" | "top"): void {
  choice.followed = null;
  for (const panel of panels) panel[how]();
  invalidate();
}

/** The second flight as ghosts in the scene of the first, or beside it. */
function together(on: boolean): void {
  choice.together = on;
  main.className = panels.length === 2 && !on ? "two" : "one";
  panels.forEach((panel, i) => {
    panel.element.hidden = on && i > 0;
    panel.together(on && i === 0);
  });
  resize();
}

function colourTrails(kind: TrailKind): void {
  trailKind = kind;
  const trail = new Trail(kind, flights);
  for (const panel of panels) panel.setTrail(trail);
  invalidate();
}

function seen(): Shown[] {
  return panels.filter((panel) => !panel.element.hidden).map((panel) => panel.shown);
}

function save(what: Saved): void {
  if (what === "table") saveTable(flights, fileName());
  else if (what === "film") film.start(seen());
  else savePicture(seen(), `${fileName()}-${Math.round(clock.time)}s`);
}

function fileName(): string {
  return flights.map(({ data: each }) => `${each.scene.name}-${each.planner}`.replace(/[^\w.-]+/g, "-")).join("-");
}

/** The flight that is still flown has gone on: who looked at its end goes on with it. */
function renew(renewed: FlightData): void {
  const atEnd = !clock.playing && clock.time >= clock.duration - 1e-6;
  flights[0].renew(renewed);
  clock.duration = longest();
  controls.renew(flights);
  for (const panel of panels) panel.renew();
  if (trailKind !== "uas") colourTrails(trailKind);
  if (atEnd) clock.seek(clock.duration);
  invalidate();
}

function resize(): void {
  for (const panel of panels) if (!panel.element.hidden) panel.resize();
  invalidate();
}

// "#t=60&follow=2&view=map&trail=power&together=1": a moment to link to
function readAddress(): void {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const number = (name: string) => Number(wanted.get(name) ?? NaN);
  if (number("t") >= 0) clock.seek(number("t"));
  if (number("follow") >= 1 && number("follow") <= flights[0].uas) {
    choice.followed = number("follow") - 1;
  }
  const trail = TRAILS.find(([kind]) => kind === wanted.get("trail"));
  if (trail) controls.showTrail(trail[0]);
  if (wanted.get("together") === "1" && panels[0].other) together(true);
  show(wanted.get("view") !== "map");
}

function loop(now: number): void {
  if (clock.playing) clock.tick(now);
  const drawn = dirty;
  if (dirty) {
    dirty = described = false;
    for (const panel of panels) {
      if (!panel.element.hidden) panel.draw(clock.time, choice.followed);
    }
    controls.draw();
    film.drawn(seen());
  } else if (!described && !clock.playing) {
    described = true;
    for (const panel of panels) panel.describe(clock.time);
  }
  pace.tick(now, drawn);
  requestAnimationFrame(loop);
}

const observer = new ResizeObserver(resize);
for (const panel of panels) {
  observer.observe(panel.stage);
  observer.observe(panel.curveBox);
}
onThemeChange(() => {
  for (const panel of panels) panel.repaint();
  invalidate();
});
addEventListener("hashchange", readAddress);
readAddress();
requestAnimationFrame(loop);

const live = source.dataset.live;
if (live) {
  document.body.classList.add("live");
  void followLive(live, renew, () => document.body.classList.replace("live", "ended"));
}
