"""What shops call the columns of a table of cuts, and what they say of a cut."""

from __future__ import annotations

import re
import unicodedata

from jointlib.lab.unit_words import unit_of

_BRACKETS = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")

_COLUMNS = {
    "chatter_frequency": r"fc|f_?chatter|.*freq(uency|uence|uenz|uenza|uencia|\.)?|.*ratterfreq\w*|hz|peak hz|"
    r"frequence d[eu] (broutement|vibration|bruit)",
    "verdict": r"verdict|results?|judge?ment|(has )?chatter(ed)?|sound|status|stable|stability|urteil|ergebnis|"
    r"bewertung|beurteilung|befund|rattern|ratter(t|marken)?|stabil|stabilitat|resultat|jugement|etat|stabilite|"
    r"broutement|esito|resultado",
    "speed": r"n|s|rpm|rev/min|(spindle )?speed( rpm)?|speed n|spindle( rpm)?|(spindel)?drehzahl( n)?|"
    r"(vitesse|frequence) de (broche|rotation)( n)?|vitesse( n)?|regime|rotation|giri|velocita|velocidad|n rpm",
    "depth": r"b|ap|a_p|doc|adoc|(axial )?depth( of cut)?( ap| b)?|(schnitt|zustell)?tiefe( ap)?|"
    r"axiale (schnitttiefe|zustellung)( ap)?|zustellung ap|profondeur( de (passe|coupe)| axiale)?( ap)?|passe( axiale)?"
    r"( ap)?|profondita|profundidad",
    "immersion": r"ae|a_e|woc|rdoc|ae ?/ ?d|a ?/ ?d|immersion|radial (depth|immersion|engagement)( of cut)?( ae)?|"
    r"stepover|width( of cut)?( ae)?|eingriff(sbreite)?( ae)?|radiale (zustellung|schnitttiefe|eingriffsbreite)( ae)?|"
    r"arbeitseingriff( ae)?|(engagement|largeur)( radiale?| de coupe)?( ae)?",
    "feed": r"f|fz|f_z|vf|ipt|ipr|ipm|chip ?load|feed( rate| per (tooth|rev(olution)?|minute))?( fz| vf| f)?|"
    r"(zahn)?vorschub( (pro|je) (zahn|umdrehung))?(sgeschwindigkeit)?( fz| vf| f)?|"
    r"avance( par (dent|tour|minute))?( fz| vf| f)?",
    "mode": r"mode|milling|(milling )?direction|up/down|down/up|climb/conventional|frasart|frasrichtung|"
    r"(gleich|gegen)lauf(/(gleich|gegen)lauf)?|sens|mode d'usinage",
    "teeth": r"z|teeth|flutes|(no\.?|number) of (teeth|flutes)|zahne(zahl)?|schneiden(zahl)?|dents|nombre de dents",
    "diameter": r"d|dia\.?|diameter( d)?|(tool|cutter) diameter|(werkzeug|fraser)?durchmesser( d)?|diametre( d)?",
    "file": r"file( ?name)?|record(ing)?|wav( file)?|audio|datei(name)?|aufnahme|tonaufnahme|fichier|enregistrement",
    "tool": r"tool|cutter|werkzeug|fraser|outil|fraise|utensile|herramienta",
    "name": r"cut|no\.?|nr\.?|#|id|name|test|pass|run|versuch|schnitt|essai|coupe|n°|prova|"
    r"(cut|test|pass|run) (no|nr|id|#)\.?",
}
"""Headings by key, without brackets, accents and capitals; the first that fits is taken."""

VERDICT_WORDS: dict[str, tuple[str, ...]] = {
    "stable": ("stable", "stabil", "OK", "i.O.", "good", "gut", "quiet", "ruhig", "clean", "smooth", "bon", "bonne",
               "calme", "pass", "in ordnung", "o.k.", "io", "no chatter", "kein rattern", "pas de broutement"),
    "chatter": ("chatter", "rattern", "broutement", "unstable", "n.i.O.", "NOK", "not ok", "nio", "bad", "schlecht",
                "instabil", "instable", "chattered", "chattering", "rattert", "ratter", "broute", "fail", "loud",
                "laut", "mauvais", "niO", "heavy chatter", "starkes rattern"),
    "marginal": ("marginal", "grenzwertig", "limite", "borderline", "slight", "leicht", "leichtes rattern", "light",
                 "slight chatter", "light chatter", "grenze", "limit", "leger", "leger broutement", "marginale"),
    "unknown": ("unknown", "unbekannt", "inconnu", "unklar", "unclear"),
}  # fmt: skip
SPEEDS = {
    **dict.fromkeys(("", "rpm", "1/min", "min-1", "min^-1", "min⁻¹", "u/min", "tr/min", "rev/min", "giri/min"), 1.0),
    **dict.fromkeys(("hz", "1/s", "rev/s", "u/s", "tr/s"), 60.0),
    **dict.fromkeys(("krpm", "x1000"), 1000.0),
}
"""Units of a speed in rpm."""
_UNITS = {*SPEEDS, "khz", "%", "ipm", "ipr", "ipt"} - {""}
_ENDING = re.compile(r"(?:^|[ _])(mm|um|µm|in|inch|rpm|ipm|ipt|ipr|hz)$", re.IGNORECASE)
_YES = {"yes", "ja", "oui", "y", "j", "o", "x", "1", "true", "si"}
_NO = {"no", "nein", "non", "n", "0", "false", "kein", "keines"}
_MODES = {
    "down": ("down", "climb", "gleichlauf", "gl", "avalant", "en avalant", "concordance", "concordant"),
    "up": ("up", "conventional", "gegenlauf", "gg", "opposition", "en opposition", "conv"),
    "slot": ("slot", "slotting", "full", "nut", "vollnut", "nuten", "rainure", "rainurage", "pleine matiere"),
}


def plain_word(text: str) -> str:
    """In small letters, without accents, marks and double blanks."""
    bare = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return " ".join(re.sub(r"[_!?.:]", " ", bare.casefold()).split())


def column_of(heading: str) -> str | None:
    """What a column holds by its heading, a key of ``[[cut]]`` or ``tool``; None where no shop calls it so."""
    bare = "".join(c for c in unicodedata.normalize("NFKD", _BRACKETS.sub("", heading)) if not unicodedata.combining(c))
    word = " ".join(re.sub(r"[?:,]", " ", bare.casefold()).split())
    word = re.sub(r"(?:^| )(?:in )?(?:mm|rpm|inch(?:es)?|in|1/min|min-1|tr/min|u/min)$", "", word) or word
    return next((key for key, pattern in _COLUMNS.items() if re.fullmatch(pattern, word)), None)


def unit_in(heading: str) -> str:
    """The unit in the last brackets of a heading, or at its end, as ``DOC in``; empty where none stands."""
    inside = re.findall(r"[\[(]([^\[\]()]*)[\])]", heading)
    ending = _ENDING.search(heading.strip())
    for word in (*reversed(inside), *([ending[1]] if ending else [])):
        length = re.sub(r"/.*", "", word).strip()
        if word.strip().casefold() in _UNITS or unit_of(length) is not None:
            return str(word.strip())
    return ""


def verdict_of(word: str, heading: str) -> str | None:
    """The verdict that a word means under a heading; None where it is none that is known."""
    plain = plain_word(word)
    found = next((v for v, words in VERDICT_WORDS.items() if plain in map(plain_word, words)), None)
    if found is None and plain in _YES | _NO:
        about = plain_word(heading)
        chatter = re.search(r"chatter|ratter|brout", about) is not None
        if chatter or "stab" in about:
            return "chatter" if (plain in _YES) == chatter else "stable"
    return found


def mode_of(word: str) -> str | None:
    """``"down"``, ``"up"`` or ``"slot"`` by what a shop calls it."""
    return next((mode for mode, words in _MODES.items() if plain_word(word) in words), None)
