"""A board's report as one self-contained page: pictures, a row a tool, an animated path.

Everything is inside the file: no font, script or picture is fetched.  Text
from the drill file is escaped wherever it appears; the path's places are
numbers in a JSON block that the script reads.
"""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

from tcp.boards.optimise import Board
from tcp.files.write import write_file
from tcp.report.board import amount, conclusions, verdict
from tcp.report.board_plot import TOOLS, Frame, Side, side_svg, sides

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:1120px;padding:0 1em;color:#222}
h1{font-size:1.4em;overflow-wrap:anywhere}h2{font-size:1.1em;margin-top:2em}
.pair{display:flex;flex-wrap:wrap;gap:12px}.pair figure{margin:0;border:1px solid #ddd}
figcaption{padding:4px 12px;color:#444}
table{border-collapse:collapse;margin:.6em 0}td,th{padding:3px 12px;border-bottom:1px solid #ddd}
td:nth-child(n+2):nth-child(-n+5),th:nth-child(n+2):nth-child(-n+5){text-align:right}
button{font:inherit;padding:4px 14px}canvas{border:1px solid #ddd;max-width:100%;display:block;
margin-top:8px}.dot{display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.4em}
"""

SCRIPT = """
"use strict";
(function(){
  const data=JSON.parse(document.getElementById("paths").textContent);
  const canvas=document.getElementById("stage"),pen=canvas.getContext("2d");
  const button=document.getElementById("play"),bar=document.getElementById("progress");
  const which=document.getElementById("which");
  let at=0,playing=false,last=0;
  function path(){return data[which.value];}
  function draw(){
    const p=path(),n=p.xy.length/2,shown=Math.min(n,Math.floor(at));
    pen.clearRect(0,0,canvas.width,canvas.height);
    pen.lineWidth=1;pen.strokeStyle="#2166ac";pen.beginPath();
    for(let i=0;i<shown;i++){const x=p.xy[2*i],y=p.xy[2*i+1];i?pen.lineTo(x,y):pen.moveTo(x,y);}
    pen.stroke();
    for(let i=0;i<n;i++){pen.fillStyle=i<shown?data.colours[p.tools[i]%data.colours.length]:"#bbb";
      pen.fillRect(p.xy[2*i]-1.5,p.xy[2*i+1]-1.5,3,3);}
    if(shown){pen.fillStyle="#cb181d";pen.beginPath();
      pen.arc(p.xy[2*shown-2],p.xy[2*shown-1],4,0,7);pen.fill();}
    bar.max=n;bar.value=shown;document.body.dataset.shown=shown;
  }
  function tick(now){
    if(!playing)return;
    const n=path().xy.length/2;
    at=Math.min(n,at+(now-last)/1000*Math.max(8,n/12));last=now;
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
    name = escape(board.before.path.name)
    facts = "".join(f"<li>{escape(line)}</li>" for line in conclusions(board, None))
    notes = "".join(f"<li>{escape(line)}</li>" for line in board.notes)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width">'
        f'<link rel="icon" href="data:,"><title>{name}: drill order</title>'
        f"<style>{STYLE}</style></head><body>"
        f"<h1>{name}</h1><ul>{facts}</ul>"
        f'<div class="pair">{_figure(before, frame)}{_figure(after, frame)}</div>'
        f"<h2>Tools</h2>{_table(board)}"
        f"{_player(frame)}"
        + (f"<h2>Notes</h2><ul>{notes}</ul>" if notes else "")
        + f'<script type="application/json" id="paths">{_paths(before, after, frame)}</script>'
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _figure(side: Side, frame: Frame) -> str:
    return (
        f'<figure><svg xmlns="http://www.w3.org/2000/svg" width="{frame.width:.0f}" '
        f'height="{frame.height:.0f}">{side_svg(side, frame)}</svg>'
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
            escape(verdict(part)),
        ]
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    links = [amount(board, c.links) for c in (board.costs_before, board.costs_after)]
    rows.append(f"<tr><td>between</td><td></td><td>{links[0]}</td><td>{links[1]}</td></tr>")
    totals = (board.costs_before.total, board.costs_after.total, board.bound)
    sums = "".join(f"<td><b>{amount(board, cost)}</b></td>" for cost in totals)
    holes = sum(part.holes for part in board.parts)
    rows.append(f"<tr><td><b>total</b></td><td>{holes}</td>{sums}</tr>")
    return f"<table>{''.join(rows)}</table>"


def _size(board: Board, tool: int) -> str:
    diameter = board.before.tools[tool].diameter
    return "" if diameter is None else f" ({float(diameter):.3f} mm)"


def _player(frame: Frame) -> str:
    return (
        '<h2>The path</h2><p><button id="play" type="button">Play</button> '
        '<select id="which"><option value="after">after</option>'
        '<option value="before">before</option></select> '
        '<progress id="progress" value="0" max="1"></progress></p>'
        f'<canvas id="stage" width="{frame.width:.0f}" height="{frame.height:.0f}"></canvas>'
    )


def _paths(before: Side, after: Side, frame: Frame) -> str:
    """The animated paths as JSON; only numbers, and no ``<`` that could end the block."""
    data = {
        name: {
            "xy": [value for place in side.places for value in frame.at(place)],
            "tools": side.tools,
        }
        for name, side in (("before", before), ("after", after))
    }
    return json.dumps(data | {"colours": TOOLS}, separators=(",", ":")).replace("<", "\\u003c")


def save_board_html(board: Board, path: Path) -> None:
    """Write the page.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_file(path, board_html(board))
