"""A board's report as one self-contained page: pictures, a row a tool, an animated path.

Everything is inside the file: no font, script or picture is fetched.  Text
from the drill file is escaped wherever it appears; the path's places are
numbers in a JSON block that the script reads.
"""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

from tcp.boards.board import Board
from tcp.files.write import write_file
from tcp.report.board import amount, conclusions, contents, verdict
from tcp.report.board_plot import TOOLS, Frame, Side, legend_svg, side_svg, sides
from tcp.report.table import percent
from tcp.words import plain

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:1140px;padding:0 1em;color:#222}
h1{font-size:1.5em;margin-bottom:.2em;overflow-wrap:anywhere}h2{font-size:1.15em;margin-top:2em}
.about{color:#666;margin-top:0}.facts{display:flex;flex-wrap:wrap;gap:12px;margin:1em 0}
.fact{border:1px solid #ddd;border-radius:6px;padding:8px 16px;min-width:8em}
.fact b{display:block;font-size:1.5em;line-height:1.3}.fact span{color:#666}
.pair{display:flex;flex-wrap:wrap;gap:12px}.pair figure{margin:0}
figcaption{padding:4px 2px;color:#444}
svg{max-width:100%;height:auto}
table{border-collapse:collapse;margin:.6em 0;width:100%}td,th{padding:4px 12px}
tr{border-bottom:1px solid #ddd}th{text-align:left;color:#666;font-weight:600}
td:nth-child(n+2):nth-child(-n+5),th:nth-child(n+2):nth-child(-n+5){text-align:right;
font-variant-numeric:tabular-nums}tr.sum td{font-weight:600}tr.sum{border-top:2px solid #bbb}
button,select{font:inherit;padding:4px 14px;margin-right:.4em}progress{width:16em}
canvas{border:1px solid #ddd;max-width:100%;display:block;margin-top:8px;background:#fbfbf9}
.dot{display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.4em}
#where{color:#666;margin-left:.6em;font-variant-numeric:tabular-nums}
"""

SCRIPT = """
"use strict";
(function(){
  const data=JSON.parse(document.getElementById("paths").textContent);
  const canvas=document.getElementById("stage"),pen=canvas.getContext("2d");
  const button=document.getElementById("play"),bar=document.getElementById("progress");
  const which=document.getElementById("which"),speed=document.getElementById("speed");
  const where=document.getElementById("where");
  let at=0,playing=false,last=0;
  function path(){return data[which.value];}
  function draw(){
    const p=path(),n=p.xy.length/2,shown=Math.min(n,Math.floor(at));
    pen.clearRect(0,0,canvas.width,canvas.height);
    pen.lineWidth=1.2;pen.strokeStyle="#2166ac";pen.beginPath();
    for(let i=0;i<shown;i++){const x=p.xy[2*i],y=p.xy[2*i+1];i?pen.lineTo(x,y):pen.moveTo(x,y);}
    pen.stroke();
    for(let i=0;i<n;i++){pen.fillStyle=i<shown?data.colours[p.tools[i]%data.colours.length]:"#bbb";
      pen.fillRect(p.xy[2*i]-1.5,p.xy[2*i+1]-1.5,3,3);}
    if(shown){pen.fillStyle="#cb181d";pen.beginPath();
      pen.arc(p.xy[2*shown-2],p.xy[2*shown-1],4,0,7);pen.fill();}
    bar.max=n;bar.value=shown;document.body.dataset.shown=shown;
    where.textContent=shown+" of "+n+(shown?", "+data.names[p.tools[shown-1]]:"");
  }
  function tick(now){
    if(!playing)return;
    const n=path().xy.length/2;
    at=Math.min(n,at+(now-last)/1000*Math.max(8,n/12)*speed.value);last=now;
    draw();
    if(at>=n){stop();return;}
    requestAnimationFrame(tick);
  }
  function stop(){playing=false;button.textContent="Play";document.body.dataset.state="stopped";}
  button.addEventListener("click",function(){
    if(playing){stop();return;}
    if(at>=path().xy.length/2)at=0;
    playing=true;button.textContent="Pause";document.body.dataset.state="playing";
    last=performance.now();requestAnimationFrame(tick);
  });
  which.addEventListener("change",function(){at=0;draw();});
  bar.addEventListener("click",function(event){
    at=event.offsetX/bar.clientWidth*path().xy.length/2;draw();});
  at=path().xy.length/2;draw();
})();
"""


def board_html(board: Board) -> str:
    """The page."""
    before, after = sides(board)
    frame = Frame.around(before.places)
    name = escape(plain(board.before.path.name))
    lines = "".join(f"<li>{escape(line)}</li>" for line in conclusions(board, None))
    notes = "".join(f"<li>{escape(line)}</li>" for line in board.notes)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width">'
        f'<link rel="icon" href="data:,"><title>{name}: drill order</title>'
        f"<style>{STYLE}</style></head><body>"
        f'<h1>{name}</h1><p class="about">{escape(contents(board))}</p>{_facts(board)}'
        f'<div class="pair">{_figure(before, frame)}{_figure(after, frame)}</div>'
        f"{_legend(board, 2 * frame.width)}<ul>{lines}</ul>"
        f"<h2>Tools</h2>{_table(board)}"
        f"{_player(frame)}"
        + (f"<h2>Notes</h2><ul>{notes}</ul>" if notes else "")
        + f'<script type="application/json" id="paths">{_paths(board, before, after, frame)}'
        f"</script><script>{SCRIPT}</script></body></html>\n"
    )


def _facts(board: Board) -> str:
    """The figures that matter most, large."""
    unit = board.wishes.machine.unit
    before, after = board.costs_before.total, board.costs_after.total
    saved = f"{100 * (before - after) / before:.2f} %" if before else "-"
    gap = percent((after - board.bound) / after) if after else "-"
    proved = sum(part.proved for part in board.parts)
    figures = [
        (f"{amount(board, before)} {unit}", "travel before"),
        (f"{amount(board, after)} {unit}", "travel after"),
        (saved, "saved"),
        (f"{amount(board, board.bound)} {unit}", f"lower bound, {gap} below"),
        (f"{proved} of {len(board.parts)}", "tools with a proof"),
    ]
    cards = (
        f'<div class="fact"><b>{figure}</b><span>{name}</span></div>' for figure, name in figures
    )
    return f'<div class="facts">{"".join(cards)}</div>'


def _legend(board: Board, width: float) -> str:
    marks, height = legend_svg(board, width)
    size = f'width="{width:.0f}" height="{height:.0f}"'
    return (
        f'<div><svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">{marks}'
        "</svg></div>"
    )


def _figure(side: Side, frame: Frame) -> str:
    return (
        f'<figure><svg xmlns="http://www.w3.org/2000/svg" width="{frame.width:.0f}" '
        f'height="{frame.height:.0f}" font-family="sans-serif">{side_svg(side, frame)}</svg>'
        f"<figcaption>{escape(side.title)}</figcaption></figure>"
    )


def _table(board: Board) -> str:
    unit = escape(board.wishes.machine.unit)
    names = {tool: i for i, tool in enumerate(sorted(board.before.used))}
    rows = [
        f"<tr><th>tool</th><th>holes</th><th>before {unit}</th><th>after {unit}</th>"
        f"<th>at least {unit}</th><th>order</th></tr>"
    ]
    for part in board.parts:
        dot = f'<span class="dot" style="background:{TOOLS[names[part.tool] % len(TOOLS)]}"></span>'
        cells = [
            f"{dot}T{part.tool}{_size(board, part.tool)}",
            str(part.holes),
            *(amount(board, cost) for cost in (part.before, part.after, part.bound)),
            escape(verdict(board, part)),
        ]
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    links = [amount(board, c.links) for c in (board.costs_before, board.costs_after)]
    rows.append(
        f"<tr><td>between tools</td><td></td><td>{links[0]}</td><td>{links[1]}</td>"
        "<td></td><td></td></tr>"
    )
    totals = (board.costs_before.total, board.costs_after.total, board.bound)
    sums = "".join(f"<td>{amount(board, cost)}</td>" for cost in totals)
    holes = sum(part.holes for part in board.parts)
    rows.append(f'<tr class="sum"><td>total</td><td>{holes}</td>{sums}<td></td></tr>')
    return f"<table>{''.join(rows)}</table>"


def _size(board: Board, tool: int) -> str:
    diameter = board.before.tools[tool].diameter
    return "" if diameter is None else f" ({float(diameter):.3f} mm)"


def _player(frame: Frame) -> str:
    return (
        '<h2>The path</h2><p><button id="play" type="button">Play</button> '
        '<select id="which"><option value="after">after</option>'
        '<option value="before">before</option></select> '
        '<select id="speed" aria-label="speed"><option value="0.25">slow</option>'
        '<option value="1" selected>normal</option><option value="4">fast</option></select> '
        '<progress id="progress" value="0" max="1"></progress><span id="where"></span></p>'
        f'<canvas id="stage" width="{frame.width:.0f}" height="{frame.height:.0f}"></canvas>'
    )


def _paths(board: Board, before: Side, after: Side, frame: Frame) -> str:
    """The animated paths as JSON; only numbers, and no ``<`` that could end the block."""
    data = {
        name: {
            "xy": [value for place in side.places for value in frame.at(place)],
            "tools": side.tools,
        }
        for name, side in (("before", before), ("after", after))
    }
    names = [f"T{tool}" for tool in sorted(board.before.used)]
    return json.dumps(data | {"colours": TOOLS, "names": names}, separators=(",", ":")).replace(
        "<", "\\u003c"
    )


def save_board_html(board: Board, path: Path) -> None:
    """Write the page; that of a private board is private, too.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_file(path, board_html(board), like=(board.before.path,))
