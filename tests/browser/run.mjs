// The pages that `yair` writes, in a real browser: `node run.mjs YAIR`, with the built command, makes them and
// looks at them; `node run.mjs YAIR --pictures DIR` takes the screenshots of the documents instead. It ends with
// "N passed, N failed" and is 0 only where nothing failed. Where there is no browser it says so and is 0, but
// with CI=true that is a failure. CHROMIUM names another browser than the usual ones.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const WIDE = { width: 1280, height: 800 }, NARROW = { width: 390, height: 844 };
/** What a mail takes, and what a reader waits, of the page of the motion-capture robot. */
const MAX_PAGE_BYTES = 1e6, MAX_LOAD_MS = 1000;
/** A line of a picture is many such pixels; noise of the renderer is none. */
const MIN_DRAWN_PIXELS = 200;
const HOSTILE = "</script><script>window.broken=1</script><img src=x onerror=window.broken=2>";

const [command, option, folder] = process.argv.slice(2);
const root = resolve(dirname(fileURLToPath(import.meta.url)), "../..");
const executablePath = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"]
  .find((path) => path && existsSync(path));
if (!command || !existsSync(command)) {
  console.error(`run.mjs: ${command || "no command given"}: build yair first, and give its path`);
  process.exit(2);
}
if (!executablePath) {
  const required = process.env.CI === "true";
  console.log(`${required ? "failed" : "skipped"}: browser: there is no chromium; install it, or name one in CHROMIUM`);
  console.log(`0 passed, ${required ? 1 : 0} failed`);
  process.exit(required ? 1 : 0);
}

const work = mkdtempSync(join(tmpdir(), "yair-pages-"));
const yair = (...words) => execFileSync(resolve(command), [...words, "--quiet"], { cwd: work, stdio: ["ignore", "ignore", "pipe"] });

/** Pages by name, each with what it must have beside what all have. */
function pages() {
  const scenario = join(root, "scenarios/motion-capture.toml");
  yair("simulate", scenario, "--out", "robot");
  // The same robot without what only shows in motion.
  const effects = /\[\[effect\]\]\nkind = "(slip_speed|wheel_eccentricity)"\n(.+\n)+\n/g;
  const text = readFileSync(scenario, "utf8");
  if ([...text.matchAll(effects)].length !== 2) throw new Error(`${scenario}: its two effects of motion are elsewhere`);
  writeFileSync(join(work, "plain.toml"), text.replace(effects, ""));
  yair("simulate", "plain.toml", "--out", "plain");
  // A slope that straights alone do not tell from carpet: what each cause predicts is drawn.
  const straights = `[[effect]]\nkind = "floor_slope"\ncreep_x_m_s = 0.0\ncreep_y_m_s = 0.0004\n\n[[protocol]]\nkind = "straights"\nlength_m = 1.5\nruns = 8\n`;
  const kept = text.replace(effects, "").split(/(?=^\[\[)/m).filter((part) => !part.startsWith("[[protocol]]"));
  writeFileSync(join(work, "slope.toml"), kept.join("") + straights);
  yair("simulate", "slope.toml", "--out", "slope");
  const hostile = join(work, "hostile");
  mkdirSync(hostile);
  for (const file of ["dataset.toml", "odometry.csv", "truth.csv"]) {
    let said = readFileSync(join(work, "robot", file), "utf8").replaceAll("straight_000", HOSTILE);
    if (file === "dataset.toml") said = `name = "${HOSTILE}"\nnotes = "${HOSTILE}"\n${said}`;
    writeFileSync(join(hostile, file), said);
  }
  // An instrument that is late, and nothing else; and a robot of rigid bodies, whose cause is in no catalogue.
  const late = text.replace(effects, "").replace(/^latency_s = .*$/m, "latency_s = 0.06");
  writeFileSync(join(work, "late.toml"), late);
  yair("simulate", "late.toml", "--out", "late");
  yair("diagnose", "late", "--out", "instrument");
  yair("diagnose", join(root, "tests/physics/logs/high_centre_of_mass-0100"), "--out", "unlisted");
  yair("simulate", join(root, "scenarios/skid-steer.toml"), "--out", "skid");
  yair("diagnose", "skid", "--out", "one");
  yair("diagnose", "robot", "--out", "found");
  yair("diagnose", "plain", "--out", "consistent");
  yair("diagnose", "hostile", "--out", "hostile-page");
  yair("diagnose", "slope", "--out", "ambiguous");
  yair("calibrate", "robot", "--out", "robot.toml", "--out-dir", "calibrate");
  yair("evaluate", "robot", "--calibration", "robot.toml", "--calibration", "found/extended.toml", "--out-dir", "evaluate");
  yair("compare", "robot", "plain", "--out-dir", "compare");
  yair("plan", "robot", "--out", "plan");
  yair("sweep", join(root, "scenarios/noise-levels.toml"), "--trials", "20", "--out", "sweep");
  yair("reproduce", "--trials", "20", "--out", "reproduce");
  // Two carts on two days, one with a tyre that wears in between (docs/fleet.md).
  const fleet = join(root, "scenarios/fleet.toml");
  for (const [cart, day, point, seed] of [[1, 23, 1, 11], [1, 24, 1, 12], [2, 23, 1, 21], [2, 24, 3, 22]])
    yair("simulate", fleet, "--point", `${point}`, "--seed", `${seed}`, "--out", `robots/cart-${cart}/${day}`,
      "--robot-id", `cart-${cart}`, "--recorded", `2026-11-${day}T08:00:00Z`);
  mkdirSync(join(work, "fleet"));
  yair("fleet", "robots", "--html", "fleet/report.html");
  const drive = { runs: true };
  const real = {};
  // Logs of real robots, where they are: fourteen sessions under motion capture, and a stranger's robot.
  const data = process.env.YAIR_DATA || join(root, "../shared/data");
  if (existsSync(join(data, "optiodom/diff"))) {
    yair("import", "optiodom", join(data, "optiodom/diff"), "--out", "june");
    yair("diagnose", "june", "--out", "june-page");
    real["june-page"] = { ...drive, first: "june" };
  }
  if (existsSync(join(data, "field/turtlebot0_wheels.csv"))) {
    const [wheels, poses] = ["wheels", "mocap"].map((part) => join(data, `field/turtlebot0_${part}.csv`));
    yair("import", "csv", wheels, poses, "--wheel", "0.07", "--base", "0.23", "--ticks-per-rev", "2578.33", "--counter-bits", "16", "--out", "kobuki");
    yair("diagnose", "kobuki", "--out", "kobuki-page");
    real["kobuki-page"] = { ...drive, first: "kobuki" };
  }
  if (Object.keys(real).length < 2) {
    console.log(`skipped: browser: pages of real robots: ${data} has no logs`);
    if (process.env.YAIR_REQUIRE_DATA === "1") throw new Error(`YAIR_REQUIRE_DATA=1, and ${data} has no logs`);
  }
  return {
    ...real,
    one: { ...drive, first: "one" }, instrument: { ...drive, first: "instrument" }, unlisted: { ...drive, first: "unlisted" },
    found: { ...drive, answers: ["Cause", "Size", "About the measurement", "Drive next"], small: true, first: "several" },
    consistent: { ...drive, answers: ["Cause", "Could not show", "About the measurement", "Drive next"], first: "none" },
    ambiguous: { ...drive, next: true },
    "hostile-page": { ...drive, hostile: true },
    calibrate: drive, evaluate: drive, compare: { plain: true }, plan: { still: true }, sweep: {}, reproduce: {},
    fleet: { small: true, answers: ["Robots with an excess", "Changes", "Failed datasets"] },
  };
}

let passed = 0, failed = 0;
function check(page, what, holds, detail = "") {
  if (holds) passed += 1;
  else { failed += 1; console.log(`failed: ${page}: ${what}${detail ? `: ${detail}` : ""}`); }
}

/** Pixels with a colour, which axes and grid do not have, and a sum that moves with any pixel. */
const pixels = (canvas) => {
  // Greys of the grid have a chroma of about 10 of 255, the colours of the tracks over 100.
  const MIN_CHROMA = 60;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0, drawn = 0;
  for (let k = 0; k < data.length; k += 4) {
    if (data[k + 3] === 0) continue;
    const [red, green, blue] = [data[k], data[k + 1], data[k + 2]];
    if (Math.max(red, green, blue) - Math.min(red, green, blue) > MIN_CHROMA) drawn += 1;
    sum = (Math.imul(sum, 31) + (red << 16) + (green << 8) + blue + k) | 0;
  }
  return { drawn, sum };
};

async function opened(browser, name, viewport, colorScheme) {
  const context = await browser.newContext({ viewport, colorScheme, reducedMotion: "reduce" });
  const page = await context.newPage();
  const errors = [];
  page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) errors.push(`loads ${request.url()}`); });
  await page.goto(pathToFileURL(join(work, name, "report.html")).href, { waitUntil: "load" });
  return { context, page, errors };
}

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Opens all parts and waits until their pictures are drawn. */
const openAll = (page) => page.evaluate(() => new Promise((done) => {
  document.querySelectorAll("details").forEach((part) => { part.open = true; });
  requestAnimationFrame(() => requestAnimationFrame(done));
}));

/** Serious and critical violations, with all parts open; the page's own policy forbids foreign scripts, so
 * that axe comes by the debugger. */
async function violations(page) {
  await openAll(page);
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  return violations.filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, nodes }) => `${id} (${nodes.length}: ${nodes[0].html.slice(0, 120)})`);
}

const WAYS = [["1280×800", WIDE, "light"], ["390×844", NARROW, "light"], ["dark", WIDE, "dark"]];

async function look(browser, name, wanted) {
  for (const [way, viewport, scheme] of wanted.hostile ? WAYS.slice(0, 1) : WAYS) {
    const { context, page, errors } = await opened(browser, name, viewport, scheme);
    const where = `${name} (${way})`;
    if (wanted.answers) {
      const outside = await page.evaluate((answers) => answers.filter((answer) => {
        const terms = [...document.querySelectorAll(".tiles dt")];
        const box = terms.find((term) => term.textContent.startsWith(answer))?.parentElement.getBoundingClientRect();
        return !box || box.top < 0 || box.bottom > window.innerHeight || box.right > window.innerWidth;
      }), wanted.answers);
      check(where, "the answers stand in the first viewport", outside.length === 0, outside.join(", "));
    }
    const width = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
    check(where, "nothing scrolls sideways", width <= 0, `${width} px`);
    const found = await violations(page);
    check(where, "axe finds nothing serious", found.length === 0, found.join("; "));
    const open = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
    check(where, "nothing scrolls sideways with all parts open", open <= 0, `${open} px`);
    const pictures = await page.$$eval("figure.picture canvas", (all) => all.length);
    const still = await page.$$eval("svg[role=img], img", (all) => all.filter((one) => one.getBoundingClientRect().width > 40).length);
    if (!wanted.plain) check(where, "pictures are there", wanted.still ? still > 0 : pictures + still > 0);
    for (const canvas of await page.$$("figure.picture canvas")) {
      const { drawn } = await canvas.evaluate(pixels);
      check(where, "a picture is drawn", drawn >= MIN_DRAWN_PIXELS, `${drawn} pixels`);
    }
    check(where, "no error on the console, and nothing is loaded", errors.length === 0, errors.join("; "));
    await context.close();
  }
  await handle(browser, name, wanted);
  const { context, page, errors } = await opened(browser, name, WIDE, "light");
  const hyphens = await page.evaluate(hyphenated);
  check(name, "numbers have minus signs, not hyphens", hyphens.length === 0, hyphens.slice(0, 3).join("; "));
  if (wanted.next) {
    const causes = await page.$$eval("#next figure.chart details.data tbody code", (all) => all.map((one) => one.textContent));
    check(name, "what each cause predicts is drawn", causes.includes("floor_slope") && causes.includes("carpet_nap"), causes.join(", "));
  }
  const dangling = await page.$$eval('a[href^="#"]', (all) => all.map((a) => a.getAttribute("href").slice(1)).filter((id) => !document.getElementById(id)));
  check(name, "links into the page lead somewhere", dangling.length === 0, dangling.join(", "));
  if (wanted.small) {
    const bytes = statSync(join(work, name, "report.html")).size;
    check(name, `at most ${MAX_PAGE_BYTES} bytes`, bytes <= MAX_PAGE_BYTES, `${bytes}`);
    // The fastest of three: whatever else runs on the machine makes a page slower, and none faster.
    const loads_ms = [];
    do {
      if (loads_ms.length > 0) await page.reload({ waitUntil: "load" });
      await page.waitForFunction(() => performance.getEntriesByType("navigation")[0].loadEventEnd > 0);
      loads_ms.push(await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd));
    } while (loads_ms.length < 3 && loads_ms.at(-1) >= MAX_LOAD_MS);
    const load_ms = Math.min(...loads_ms);
    check(name, `loads within ${MAX_LOAD_MS} ms`, load_ms > 0 && load_ms < MAX_LOAD_MS, `${loads_ms.join(", ")} ms`);
  }
  if (wanted.runs) {
    const canvas = await page.$("figure.path canvas");
    const before = await canvas.evaluate(pixels);
    // By keys alone: Tab until the first run's switch, then Space.
    let reached = false;
    for (let k = 0; k < 120 && !reached; k++) {
      await page.keyboard.press("Tab");
      reached = await page.evaluate(() => document.activeElement.matches("fieldset .runs input"));
    }
    check(name, "Tab reaches the switches of runs", reached);
    await page.keyboard.press("Space");
    const off = await canvas.evaluate(pixels);
    check(name, "Space switches a run off, and the picture changes", off.sum !== before.sum && off.drawn !== before.drawn);
    await page.keyboard.press("Space");
    check(name, "Space again brings the same picture back", (await canvas.evaluate(pixels)).sum === before.sum);
  }
  if (wanted.hostile) {
    check(name, "names of runs run nothing", (await page.evaluate(() => window.broken)) === undefined && errors.length === 0, errors.join("; "));
    check(name, "the name of a run is shown as text", (await page.evaluate(() => document.body.innerText)).includes(HOSTILE));
  }
  if (wanted.first) await firstScreen(page, name, wanted.first);
  await page.emulateMedia({ media: "print" });
  const controls = await page.$$eval("button, input, select, nav", (all) => all.filter((one) => one.getClientRects().length > 0).map((one) => one.outerHTML.slice(0, 60)));
  check(name, "print has no controls", controls.length === 0, `${controls.length}: ${controls[0]}`);
  await context.close();
}

/** What the first screen of each kind of log must say; numbers are those of the JSON document. `drift` says how many
 * bars there are, of held-out runs but for a single run. */
const FIRST_SCREENS = {
  none: { drift: 2, headline: /^Calibrate the wheels first: the drift falls from/, cause: /^Nothing seen/ },
  one: { drift: 2, headline: /skidding in turns shortens the distance driven/i, cause: /^Skidding in turns/, id: "turn_slip" },
  several: { drift: 3, headline: /What is left: a wheel is not round or not centred\.$/, cause: /^A wheel is not round/, id: "wheel_eccentricity" },
  // The instrument's clock is no headline, and its offset is taken off the records before both models: no third bar.
  instrument: { drift: 2, headline: /^Calibrate the wheels first/, not: /late|timestamp/, measurement: /^The instrument's timestamps are late/, id: "truth_latency" },
  unlisted: { drift: 3, headline: /^Calibrate the wheels first/, badge: "Cause not certain" },
  june: { drift: 3, headline: /What is left, most likely: the faster the robot turns, the nearer together its wheels act\.$/, cause: /nearer together/, badge: "Cause not certain", id: "turn_rate_wheelbase" },
  kobuki: { drift: 2, one: true, headline: /^Most likely a wheel slides under hard acceleration\.$/, not: /mounted at an angle/, measurement: /^The instrument is mounted at an angle/, id: "truth_yaw" },
};

/** The first screen of a diagnosis by content: what the page says against what the JSON document says. */
async function firstScreen(page, name, kind) {
  const wanted = FIRST_SCREENS[kind];
  const document = JSON.parse(readFileSync(join(work, name, "findings.json"), "utf8"));
  const shown = await page.evaluate(() => {
    const text = (selector) => [...window.document.querySelectorAll(selector)].map((one) => one.textContent.trim());
    const tiles = Object.fromEntries([...window.document.querySelectorAll(".tiles > div")].map((tile) =>
      [tile.querySelector("dt").textContent, { text: tile.querySelector(".value").textContent, lines: [...tile.querySelectorAll("dd")].map((dd) => Math.round(dd.getClientRects()[0].height / parseFloat(getComputedStyle(dd).lineHeight))) }]));
    return { headline: text("h1")[0], lead: text(".lead")[0] || "", badge: text(".badge")[0], header: window.document.querySelector("header").innerText, bars: text(".bars .number"), tiles };
  });
  const { headline, tiles, bars } = shown;
  check(name, "the headline says what to change first", wanted.headline.test(headline) && !(wanted.not && wanted.not.test(headline)), headline);
  check(name, "one bar for each drift", bars.length === wanted.drift, bars.join(", "));
  const drift = document.drift;
  check(name, "drift is of held-out runs, but for a single run", Boolean(drift) === !wanted.one);
  if (drift) {
    const values = [drift.nominal, drift.calibrated, drift.extended].filter(Boolean);
    const agree = bars.every((bar, k) => Math.abs(parseFloat(bar) - values[k].percent) <= 0.05 * values[k].percent && bar.includes("±"));
    check(name, "bars show the drift of the document", agree, `${bars.join(", ")}: ${values.map((one) => one.percent).join(", ")}`);
    const { base, extended, low } = drift.calibrated_over_nominal;
    if (low > 0) {
      const numbers = (headline + shown.lead).match(/falls from ([\d.]+)\s% to ([\d.]+)\s%/);
      const near = (text, value) => Math.abs(parseFloat(text) - value) <= 0.06 * value;
      check(name, "the sentence has the drift of the document", numbers !== null && near(numbers[1], base) && near(numbers[2], extended), headline);
    }
  }
  if (wanted.id) check(name, "it is the finding of the document", document.findings.some(({ id }) => id === wanted.id), document.findings.map(({ id }) => id).join(", "));
  if (wanted.badge) check(name, "the badge says how certain it is", shown.badge === wanted.badge, shown.badge);
  const tile = (label) => tiles[label] ? tiles[label].text : "";
  if (wanted.cause) check(name, "the tile has the cause", wanted.cause.test(tile("Cause")), tile("Cause"));
  if (wanted.measurement) check(name, "the instrument has its own tile", wanted.measurement.test(tile("About the measurement")), tile("About the measurement"));
  const identifiers = shown.header.replace(/^.*yair .*$/m, "").match(/\b[a-z]+_[a-z_]+\b/g) || [];
  check(name, "no identifiers on the first screen", identifiers.length === 0, identifiers.join(", "));
  const long = Object.entries(tiles).filter(([, { lines }]) => lines.some((count) => count > 3)).map(([label, { lines }]) => `${label}: ${lines}`);
  check(name, "tiles have three lines at most", long.length === 0, long.join("; "));
  const signs = Object.values(tiles).map(({ text }) => text).concat(headline).filter((text) => /[−-]\d/.test(text));
  check(name, "signs are words", signs.length === 0, signs.join("; "));
  // A run is chosen, and its errors are drawn.
  const select = await page.$("figure.errors select");
  check(name, "errors along a run are drawn", select !== null && (await page.$$("figure.errors canvas")).length > 0);
  if ((await page.$$("figure.errors select:first-of-type option")).length > 3) {
    const before = await page.$eval("figure.errors canvas", pixels);
    await select.selectOption("1");
    check(name, "another run has other errors", (await page.$eval("figure.errors canvas", pixels)).sum !== before.sum);
  }
  const pages = await printed(page);
  check(name, "prints on eight pages at most without the appendix", pages <= 8, `${pages}`);
}

/** Pages of paper without the appendix. */
async function printed(page) {
  await page.evaluate(() => document.getElementById("appendix")?.remove());
  const paper = await page.pdf({ format: "A4" });
  return (paper.toString("latin1").match(/\/Type\s*\/Page[^s]/g) || []).length;
}

/** What the tutorial makes (docs/tutorial.md): the robot that drifts, diagnosed. */
function tutorial() {
  yair("simulate", join(root, "scenarios/drifting.toml"), "--out", "lab");
  yair("import", "csv", "lab/odometry.csv", "lab/truth.csv", "--out", "monday", "--wheel", "0.16", "--base", "0.363", "--ticks-per-rev", "40000");
  yair("diagnose", "monday", "--out", "diagnosis");
  yair("calibrate", "monday", "--out", "monday.toml");
  yair("simulate", join(root, "scenarios/drifting.toml"), "--seed", "2", "--out", "lab-tuesday");
  yair("import", "csv", "lab-tuesday/odometry.csv", "lab-tuesday/truth.csv", "--out", "tuesday", "--robot", "monday/dataset.toml");
  for (const command of Object.values(OTHER_PAGES))
    yair(...command.split(" ").map((word) => (word.startsWith("scenarios/") ? join(root, word) : word)));
}

/** Every other page of the same robot, by the command that writes it. */
const OTHER_PAGES = {
  calibrate: "calibrate monday --method all --out all.toml --out-dir calibrate",
  evaluate: "evaluate tuesday --calibration monday.toml --calibration diagnosis/extended.toml --out-dir evaluate",
  compare: "compare monday tuesday --out-dir compare",
  plan: "plan monday --out plan",
  sweep: "sweep scenarios/noise-levels.toml --trials 400 --out sweep",
  reproduce: "reproduce --trials 400 --out reproduce",
};

/** Numbers with a hyphen for a minus sign, but for what is to be copied, which stays as programs read it. */
const hyphenated = () => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
  for (let node = walker.nextNode(); node; node = walker.nextNode())
    if (!node.parentElement.closest("pre, code, script, style") && /(^|[\s(±→])-\d/.test(node.data)) found.push(node.data.trim());
  return found;
};

let last = Promise.resolve();

/** What `work` returns, which begins when all work before it is done: for what the pages share. */
const alone = (work) => {
  const result = last.then(work);
  last = result.catch(() => {});
  return result;
};

/** Hands on the page: the wheel, two fingers, the button that copies. */
async function handle(browser, name, wanted) {
  if (!wanted.runs || wanted.hostile) return;
  const { context, page } = await opened(browser, name, WIDE, "light");
  const canvas = await page.$("figure.path canvas");
  await canvas.scrollIntoViewIfNeeded();
  const sum = async () => (await canvas.evaluate(pixels)).sum;
  const box = await canvas.boundingBox();
  const middle = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(...middle);
  const whole = await sum();
  await page.mouse.wheel(0, -300);
  await page.waitForTimeout(50);
  check(name, "the wheel scrolls past a picture that was not clicked", (await sum()) === whole);
  await canvas.scrollIntoViewIfNeeded();
  await page.focus("figure.path .plot");
  const again = await canvas.boundingBox();
  await page.mouse.move(again.x + again.width / 2, again.y + again.height / 2);
  await page.mouse.wheel(0, -300);
  for (let k = 0; k < 40 && (await sum()) === whole; k++) await page.waitForTimeout(50);
  check(name, "the wheel magnifies a picture that has the focus", (await sum()) !== whole);
  await page.keyboard.press("0");
  check(name, "0 shows all again", (await sum()) === whole);
  if (await page.$("button.copy")) {
    // Where files get no clipboard the page selects the text instead, and says so. The browser has one clipboard for all pages.
    await context.grantPermissions(["clipboard-read", "clipboard-write"]).catch(() => {});
    const expected = await page.$eval(".code code", (code) => code.textContent);
    const { said, copied } = await alone(async () => {
      await page.click("button.copy");
      await page.waitForFunction(() => document.querySelector("button.copy").textContent !== "Copy");
      const said = await page.textContent("button.copy");
      return { said, copied: await page.evaluate(() => navigator.clipboard.readText().catch(() => getSelection().toString())) };
    });
    check(name, "the button copies the text", copied.trim() === expected.trim() && /Copied|Selected/.test(said), `${said}: ${copied}`);
  }
  await context.close();

  // Two fingers on a phone, as the browser itself makes their events.
  const phone = await browser.newContext({ viewport: NARROW, hasTouch: true, isMobile: true, reducedMotion: "reduce" });
  const touched = await phone.newPage();
  await touched.goto(pathToFileURL(join(work, name, "report.html")).href, { waitUntil: "load" });
  const plot = await touched.$("figure.path canvas");
  await plot.scrollIntoViewIfNeeded();
  const before = (await plot.evaluate(pixels)).sum, at = await plot.boundingBox();
  const session = await phone.newCDPSession(touched);
  const [x, y] = [at.x + at.width / 2, at.y + at.height / 2];
  const fingers = (apart) => [{ x: x - apart, y, id: 1 }, { x: x + apart, y, id: 2 }];
  const touch = (type, touchPoints) => session.send("Input.dispatchTouchEvent", { type, touchPoints });
  await touch("touchStart", fingers(30));
  for (const apart of [40, 55, 70, 90]) await touch("touchMove", fingers(apart));
  await touch("touchEnd", []);
  check(name, "two fingers magnify the picture", (await plot.evaluate(pixels)).sum !== before);
  await phone.close();
}

/** The file beside the screenshots: of each the texts that can be read in it, as far as no script writes them. A test
 * (tests/architecture/pictures.rs) compares them with the pages that the commands write now. */
const SHOWN = "report-pictures.json";

/** The texts within `clip` of a page, in its order: those that no script wrote. */
const shownTexts = (page, clip, source) => page.evaluate(({ clip, source }) => {
  const written = new Set(), texts = [];
  const nodes = (root) => document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  const plain = (node) => node.data.replace(/\s+/g, " ").trim();
  const own = nodes(new DOMParser().parseFromString(source, "text/html").body);
  while (own.nextNode()) written.add(plain(own.currentNode));
  const all = nodes(document.body);
  while (all.nextNode()) {
    const range = document.createRange(), text = plain(all.currentNode);
    range.selectNode(all.currentNode);
    const box = range.getBoundingClientRect(), top = box.top + window.scrollY;
    const inside = box.width > 0 && top >= clip.y && top + box.height <= clip.y + clip.height;
    if (text && inside && written.has(text)) texts.push(text);
  }
  return texts;
}, { clip, source });

/** Screenshots as WebP, of what the documents show: a part of a page, from the top of one element to the
 * bottom of another one; of other pages the first screen. */
async function take(browser, into) {
  tutorial();
  const MARGIN = 5;
  const others = Object.keys(OTHER_PAGES).map((name) => [`report-${name}.webp`, name, WIDE, "light", 70]);
  const shown = {};
  for (const [file, name, viewport, scheme, quality, first, last] of [
    ["report-diagnosis.webp", "diagnosis", WIDE, "light", 80, "header .badge, h1", ".tiles"],
    ["report-path.webp", "diagnosis", WIDE, "light", 80, "figure.path h3", "figure.path canvas"],
    ["report-residuals.webp", "diagnosis", WIDE, "light", 80, "#residuals figure:last-of-type", "#residuals figure:last-of-type"],
    ["report-next.webp", "diagnosis", WIDE, "light", 80, "#next h2", "#next table"],
    ["report-narrow.webp", "diagnosis", NARROW, "dark", 80, "header .badge, h1", ".tiles"],
    ...others,
  ]) {
    const { context, page } = await opened(browser, name, viewport, scheme);
    const clip = first ? await page.evaluate(([first, last, margin]) => {
      const [from, to] = [first, last].map((selector) => document.querySelector(selector).getBoundingClientRect());
      const x = Math.max(0, Math.min(from.left, to.left) - margin), y = Math.max(0, from.top + window.scrollY - margin);
      const width = Math.max(from.right, to.right) + margin - x;
      return { x, y, width, height: to.bottom + window.scrollY + margin - y, scale: 1 };
    }, [first, last, MARGIN]) : { x: 0, y: 0, ...viewport, scale: 1 };
    const session = await context.newCDPSession(page);
    const { data } = await session.send("Page.captureScreenshot", { format: "webp", quality, clip, captureBeyondViewport: true });
    writeFileSync(join(into, file), Buffer.from(data, "base64"));
    shown[file] = { page: name, command: OTHER_PAGES[name] ? `yair ${OTHER_PAGES[name]}` : "docs/tutorial.md", texts: await shownTexts(page, clip, readFileSync(join(work, name, "report.html"), "utf8")) };
    console.log(`${file}: ${statSync(join(into, file)).size} bytes, ${shown[file].texts.length} texts`);
    await context.close();
  }
  writeFileSync(join(into, SHOWN), `${JSON.stringify(shown, null, 1)}\n`);
}

/** Every page as PNG, to be looked at. */
async function takeAll(browser, into, names) {
  for (const name of names) for (const [way, viewport, scheme] of WAYS) {
    const { context, page } = await opened(browser, name, viewport, scheme);
    await page.screenshot({ path: join(into, `${name}-${way.replace("×", "x")}.png`), fullPage: true });
    await context.close();
  }
}

let browser;
try {
  const all = option === "--pictures" ? {} : pages();
  // Without its own sandbox, which a container's root does not have; the pages are our own.
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--hide-scrollbars"] });
  if (option === "--pictures") await take(browser, folder);
  else if (option === "--all-pictures") await takeAll(browser, folder, Object.keys(all));
  // Two at a time, as CI has two cores.
  else {
    const waiting = Object.entries(all);
    const worker = async () => {
      for (let next = waiting.shift(); next; next = waiting.shift()) await look(browser, ...next);
    };
    await Promise.all([worker(), worker()]);
  }
} catch (error) {
  failed += 1;
  console.log(`failed: ${error.stderr ? error.stderr.toString() : error.stack}`);
} finally {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
}
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed > 0 ? 1 : 0);
