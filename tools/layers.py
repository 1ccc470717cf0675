#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""layers.py BUILD — who includes whom, who calls whom, which file sees which library; and licence lines.

Read from the sources, from the tables of docs/architecture.md, and from the symbols of the objects below BUILD:
  lib       C standard headers that a microcontroller has, and lib
  firmware  lib, itself, headers that a microcontroller has; a board's files only for that board; board_host also POSIX
  host      lib; inside a folder all of its headers; of another folder its public header only, and only of folders
            that stand above it in the page's table
  tests/truth  itself and outside libraries;   nobody includes tests
  an outside library  only the file that the page names (tests are free)
  circles   none: among folders, among files that include each other, among files of host/ that call each other
Prints a row for each folder of host/. Exit status 1 with one line for each thing that is wrong.
"""
import os
import re
import subprocess
import sys
from pathlib import Path

PAGE = 'docs/architecture.md'
FREESTANDING = re.compile(r'(float|iso646|limits|stdalign|stdarg|stdbool|stddef|stdint|stdnoreturn|math|complex|string)\.h$')
LIBRARIES = {
    'libfyaml': r'libfyaml\.h', 'jansson': r'jansson\.h', 'matio': r'matio(_pubconf)?\.h', 'libsndfile': r'sndfile\.h',
    'BearSSL': r'bearssl.*\.h', 'FFTW': r'fftw3?\.h', 'CHOLMOD': r'(suitesparse/)?(cholmod|SuiteSparse).*\.h',
    'ARPACK': r'(arpack/)?arpack.*\.h', 'LAPACKE': r'(openblas/)?lapacke?.*\.h', 'CBLAS': r'(openblas/)?cblas.*\.h',
    'NLopt': r'nlopt\.h', 'libserialport': r'libserialport\.h', 'libmicrohttpd': r'microhttpd\.h', 'SQLite': r'sqlite3\.h', 'MPI': r'mpi\.h',
    'SUNDIALS': r'(sundials|cvode|cvodes|arkode|nvector|sunmatrix|sunlinsol)/.*\.h'}
AREAS = ('lib', 'host', 'firmware', 'tests', 'tools')

complaints = []


def broke(text):
    complaints.append(text)


def read(path):
    return Path(path).read_text(encoding='utf-8', errors='replace')


def table(first_cell):
    """Rows of the page's table whose first heading is first_cell, cells stripped."""
    rows, on = [], False
    for line in read(PAGE).splitlines():
        cells = [c.strip() for c in line.strip('|').split('|')] if line.startswith('|') else []
        if cells and cells[0] == first_cell:
            on = True
        elif on and not cells:
            break
        elif on and not set(line) <= set('|- '):
            rows.append(cells)
    return rows


def quoted(cell):
    return re.findall(r'`([^`]+)`', cell)


FOLDERS = {quoted(row[0])[0].rstrip('/'): quoted(row[1])[0] for row in table('folder of host/')}
ORDER = list(FOLDERS)
OWNERS = {name: quoted(row[1]) for row in table('library') for name in re.split(r',\s*', row[0])}


def includes(path):
    return re.findall(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]*)[>"]', read(path), re.M)


def in_tree(name, path):
    """A quoted header as a path of this tree, or None."""
    for folder in (os.path.dirname(path), 'lib', 'host', 'tests', 'tests/truth', 'tools', 'firmware'):
        candidate = os.path.normpath(os.path.join(folder, name))
        if os.path.exists(candidate):
            return candidate
    return None


def folder_of(path):
    """Folder of a host file as the page names it; main.c and a file that stands in none: ''."""
    return os.path.dirname(os.path.relpath(path, 'host'))


def check_lib(path, name, target):
    if target:
        if not target.startswith('lib/'):
            broke(f'{path} includes {target}: lib knows only lib')
    elif not FREESTANDING.match(name):
        broke(f'{path} includes <{name}>: a microcontroller may not have it')
    elif re.match(r'(math|complex)\.h$', name) and path != 'lib/beam_real.h':
        broke(f'{path} includes <{name}>: only lib/beam_real.h does')


def check_firmware(path, name, target):
    if target and not target.startswith(('lib/', 'firmware/')):
        broke(f'{path} includes {target}: firmware knows lib and itself')
    if target and re.match(r'firmware/board_\w+/', target) and os.path.dirname(target) != os.path.dirname(path):
        broke(f"{path} includes {target}: a board's own files are its own")
    allowed = path.startswith('firmware/board_host/') or name == 'stdatomic.h' or FREESTANDING.match(name) or \
        (path, name) == ('firmware/authentic.c', 'bearssl.h')
    if not target and not allowed:
        broke(f'{path} includes <{name}>: a microcontroller may not have it')


def check_host(path, _name, target):
    if not target:
        return
    if not target.startswith(('lib/', 'host/')):
        broke(f'{path} includes {target}: host knows lib and host')
        return
    mine = folder_of(path)
    if mine and mine not in FOLDERS:
        broke(f'{path} stands in no folder of {PAGE}')
    if target.startswith('lib/') or folder_of(target) == mine:
        return
    theirs = folder_of(target)
    if theirs not in FOLDERS:
        broke(f'{path} includes {target}, which stands in no folder of {PAGE}')
    elif os.path.basename(target) != FOLDERS[theirs]:
        broke(f'{path} includes {target}: the public header of host/{theirs}/ is {FOLDERS[theirs]}')
    elif mine in FOLDERS and ORDER.index(theirs) > ORDER.index(mine):
        broke(f'{path} includes {target}: an arrow up, host/{theirs}/ stands below host/{mine}/')


def check_truth(path, _name, target):
    if target and not target.startswith('tests/truth/'):
        broke(f'{path} includes {target}: the truth shares nothing with what it judges')


CHECKS = (('lib/', check_lib), ('firmware/', check_firmware), ('host/', check_host), ('tests/truth/', check_truth))


def check_library(path, name):
    for library, pattern in LIBRARIES.items():
        if not re.match(pattern + '$', name) or (path, library) == ('firmware/authentic.c', 'BearSSL'):
            continue
        owners = OWNERS.get(library, [])
        if not path.startswith('host/') or os.path.relpath(path, 'host') not in owners:
            broke(f'{path} includes <{name}>: {PAGE} gives {library} to {", ".join(owners)}')


def check_includes(path):
    for mark, name in includes(path):
        target = in_tree(name, path) if mark == '"' else None
        if mark == '"' and not target and 'bench' not in path:
            broke(f'{path} includes "{name}", which is not in the tree')
        if target and target.startswith('tests/') and not path.startswith('tests/'):
            broke(f'{path} includes {target}: nobody includes tests')
        for beginning, check in CHECKS:
            if path.startswith(beginning):
                check(path, name, target)
        if not target and not path.startswith('tests/'):
            check_library(path, name)


def licence(path):
    wanted = {'lib': 'MIT', 'firmware': 'MIT', 'tools': '(GPL-3.0-or-later|MIT)'}.get(path.split('/')[0], 'GPL-3.0-or-later')
    if path.startswith('tests/target/plugin/'):
        wanted = 'GPL-2.0-or-later'  # it runs inside QEMU, which is GPL version 2
    head = '\n'.join(read(path).splitlines()[:3])
    if not re.search(rf'SPDX-License-Identifier: {wanted}\b', head):
        broke(f"{path}: no 'SPDX-License-Identifier: {wanted}' at its top")


def circles(graph):
    """Strongly connected sets of more than one node (Tarjan, without recursion). graph: node -> set of nodes."""
    index, low, stack, on, found = {}, {}, [], set(), []
    for root in sorted(graph):
        if root in index:
            continue
        work = [(root, iter(sorted(graph[root])))]
        index[root] = low[root] = len(index)
        stack.append(root), on.add(root)
        while work:
            node, rest = work[-1]
            step = next(rest, None)
            if step is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    one = []
                    while not one or one[-1] != node:
                        one.append(stack.pop())
                        on.discard(one[-1])
                    if len(one) > 1:
                        found.append(sorted(one))
            elif step not in index:
                index[step] = low[step] = len(index)
                stack.append(step), on.add(step)
                work.append((step, iter(sorted(graph.get(step, ())))))
            elif step in on:
                low[node] = min(low[node], index[step])
    return found


def include_graph(files):
    """Which header includes which; a .c file is included by none."""
    graph = {}
    for path in files:
        targets = (in_tree(name, path) for mark, name in includes(path) if mark == '"')
        graph[path] = {t for t in targets if t}
    return {path: {t for t in targets if t in graph} for path, targets in graph.items()}


def call_graph(objects, area):
    """Which source file uses a symbol of which other, by nm. The objects lie below a folder that mirrors the sources."""
    defined, used = {}, {}
    for path in sorted(Path(objects).rglob('*.o')):
        node = str(Path(area) / path.relative_to(objects).with_suffix(''))
        if not os.path.exists(node + '.c'):
            continue  # of a source that has moved since
        used[node] = set()
        for line in subprocess.run(['nm', str(path)], capture_output=True, text=True, check=True).stdout.splitlines():
            words = line.split()
            if len(words) == 2 and words[0] == 'U':
                used[node].add(words[1])
            elif len(words) == 3 and words[1] in 'TDBRC':
                defined[words[2]] = node
    if not used:
        broke(f'{objects} holds no objects: make first')
    return {node: {defined[s] for s in symbols if s in defined} - {node} for node, symbols in used.items()}


def folder_graph(files):
    graph = {folder: set() for folder in ORDER}
    for path in files:
        for mark, name in includes(path):
            target = in_tree(name, path) if mark == '"' else None
            if target and target.startswith('host/') and folder_of(path) in graph and folder_of(target) in graph:
                graph[folder_of(path)].add(folder_of(target))
    return {folder: uses - {folder} for folder, uses in graph.items()}


def check_circles(what, graph):
    found = circles(graph)
    for one in found:
        broke(f'a circle of {what}: {", ".join(one)}')
    return len(found)


def check_gnuplot(files):
    for path in files:
        runs = re.search(r'(popen|exec\w*|system)\([^;]*"[^"]*gnuplot', read(path))
        if runs and os.path.relpath(path, 'host') not in OWNERS['gnuplot (a program)']:
            broke(f'{path} runs gnuplot: only {", ".join(OWNERS["gnuplot (a program)"])} does')


def print_table(files, graph, counts):
    print(f'{"folder of host/":<17}{"files":>6}{"lines":>8}  {"public header":<14}{"lines":>6}  uses')
    total_files = total_lines = 0
    for folder in ORDER:
        mine = [f for f in files if folder_of(f) == folder]
        lines = sum(read(f).count('\n') for f in mine)
        header = FOLDERS[folder]
        of_header = read(f'host/{folder}/{header}').count('\n') if os.path.exists(f'host/{folder}/{header}') else 0
        uses = ' '.join(f for f in ORDER if f in graph[folder])
        print(f'{folder:<17}{len(mine):>6}{lines:>8}  {header:<14}{of_header:>6}  {uses}')
        total_files, total_lines = total_files + len(mine), total_lines + lines
    print(f'{"all":<17}{total_files:>6}{total_lines:>8}  {len(ORDER)} folders')
    ups = sum(ORDER.index(b) > ORDER.index(a) for a in ORDER for b in graph[a])
    print(f'arrows between folders {sum(map(len, graph.values()))}, up {ups}; circles of ' +
          ', '.join(f'{what} {n}' for what, n in counts))


def main():
    os.chdir(Path(__file__).resolve().parent.parent)
    build = sys.argv[1] if len(sys.argv) > 1 else 'build'
    sources = sorted(str(p) for a in AREAS for p in Path(a).rglob('*') if p.suffix in ('.c', '.h'))
    scripts = sorted(str(p) for a in AREAS for p in Path(a).rglob('*') if p.suffix in ('.sh', '.mk', '.py'))
    host = [f for f in sources if f.startswith('host/')]
    if not FOLDERS or not host:
        broke(f'no sources, or no table of folders in {PAGE}')
    for path in sources:
        check_includes(path)
    for path in sources + scripts + ['Makefile', 'tests/run', '.ci/run']:
        licence(path)
    check_gnuplot([f for f in host if f.endswith('.c')])
    graph = folder_graph(host)
    counts = [('folders', check_circles('folders', graph)),
              ('files by includes', check_circles('files that include each other', include_graph(
                  [f for f in sources if not f.startswith('tests/')]))),
              ('files by calls', check_circles('files that call each other', call_graph(f'{build}/host', 'host')))]
    print_table(host, graph, counts)
    for text in complaints:
        print('layers:', text, file=sys.stderr)
    if not complaints:
        print(f'layers: clean ({len(sources)} files)')
    return bool(complaints)


if __name__ == '__main__':
    sys.exit(main())
