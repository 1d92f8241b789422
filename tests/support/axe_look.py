"""A page in headless Chromium, judged by axe-core: what would keep somebody from reading it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
from importlib.resources import files
from pathlib import Path

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# In a frame, since a headless window has a least width, and the scheme of colours is that of the frame's element.
_OUTER = """<!doctype html><title>looks at a page</title><style>body {{ margin: 0 }}</style>
<script>addEventListener("message", message => {{
  const out = document.createElement("script"); out.type = "application/json"; out.id = "axe";
  out.textContent = JSON.stringify(message.data); document.body.append(out);
}})</script>
<iframe src="page.html" style="color-scheme: {scheme}; width: {width}px; height: {height}px; border: 0"></iframe>
"""
_INNER = """
addEventListener("load", async () => {
  const said = await axe.run(document, {resultTypes: ["violations"]});
  const words = v => [v.id, v.help, v.nodes[0].html.slice(0, 120), ...v.nodes[0].any.map(a => a.message)].join(": ");
  parent.postMessage({
    found: said.violations.map(words), n_rules: said.passes.length + said.violations.length,
    wide: document.documentElement.scrollWidth > innerWidth, width: innerWidth,
    dark: matchMedia("(prefers-color-scheme: dark)").matches,
  }, "*");
})
"""


def look(page: Path, width: int, height: int, dark: bool) -> dict:
    """What is found on a screen: violations (`found`), is the page wider (`wide`), rules that applied (`n_rules`)."""
    axe = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    scripts = f"<script>{axe}</script><script>{_INNER}</script>"
    with tempfile.TemporaryDirectory() as folder:
        text = page.read_text(encoding="utf-8")
        (Path(folder) / "page.html").write_text(text.replace("</body>", scripts + "</body>"), encoding="utf-8")
        outer = Path(folder) / "outer.html"
        outer.write_text(_OUTER.format(scheme="dark" if dark else "light", width=width, height=height))
        options = ["--headless", "--no-sandbox", "--disable-gpu", f"--window-size={max(width, 800)},{height}"]
        options += [f"--user-data-dir={folder}/profile", "--virtual-time-budget=20000"]
        command = [str(BROWSER), *options, "--dump-dom", outer.as_uri()]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    (found,) = re.findall(r'<script type="application/json" id="axe">(.*?)</script>', done.stdout, re.S)
    answer: dict = json.loads(found)
    assert (answer["width"], answer["dark"]) == (width, dark), "the page was not looked at as asked for"
    return answer
