#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""schema.py BEAMFIT — holds every COMMAND.*.answer of this directory against `beamfit COMMAND --json-schema`.

Every command must have an answer here, whole or one object a line. Status 77: jsonschema is not installed.
"""
import glob
import json
import re
import subprocess
import sys

try:
    from jsonschema import Draft202012Validator
except ImportError:
    sys.exit(77)


def run(*arguments):
    """Standard output of the program."""
    return subprocess.run([sys.argv[1], *arguments], check=True, capture_output=True, text=True).stdout


def answers(path):
    """The objects of a file."""
    with open(path, encoding='utf-8') as file:
        text = file.read()
    try:
        return [json.loads(text)]
    except json.JSONDecodeError:
        return [json.loads(line) for line in text.splitlines()]


def undescribed(schema, where):
    """Names below a schema that have no words."""
    for name, one in schema.get('properties', {}).items():
        if not one.get('description'):
            yield f'{where}.{name}'
        for inner in [one, one.get('items', {}), one.get('additionalProperties') or {}, *one.get('anyOf', [])]:
            if inner is not False:
                yield from undescribed(inner, f'{where}.{name}')


def check(command, failures):
    """One command: its schema, and its answers here."""
    schema = json.loads(run(command, '--json-schema'))
    Draft202012Validator.check_schema(schema)
    failures += [f'{name} has no description' for name in undescribed(schema, command)]
    validator = Draft202012Validator(schema)
    paths = sorted(glob.glob(f'{command}.*answer'))
    if not paths:
        failures.append(f'{command}: there is no answer to look at')
    for path in paths:
        for answer in answers(path):
            failures += [f'{path}: {"/".join(map(str, e.absolute_path))}: {e.message[:300]}'
                         for e in validator.iter_errors(answer)]
            required = schema['required']
            spoilt = [{**answer, 'a name that nobody knows': 1}]
            if required:
                spoilt.append({name: value for name, value in answer.items() if name != required[0]})
            failures += [f'{path}: the schema takes what is wrong' for wrong in spoilt if validator.is_valid(wrong)]


def main():
    """All commands of the program."""
    failures = []
    commands = re.findall(r'^  ([a-z]+)  ', run(), re.M)
    for command in commands:
        check(command, failures)
    print('\n'.join(failures) or f'{len(commands)} commands')
    sys.exit(1 if failures or len(commands) < 20 else 0)


main()
