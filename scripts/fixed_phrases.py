"""The phrases of diagnosis.json that do not change, each with what people read instead (src/diagnosis/plain_words.hpp)."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = "src/diagnosis/plain_words.hpp"
PAIR = re.compile(r'^    \{"([^"]*)",\s*"([^"]*)"\},$', re.MULTILINE)


def fixed_phrases(root=ROOT):
    """Pairs of a fixed phrase and its plain form; none in a tree without the table."""
    table = root / TABLE
    return PAIR.findall(table.read_text()) if table.exists() else []


def in_plain_words(sentence):
    for fixed, plain in fixed_phrases():
        sentence = sentence.replace(fixed, plain)
    return sentence
