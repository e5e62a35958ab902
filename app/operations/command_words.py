"""What `pyroshock --help` says of each command, by section, and the nouns, below which several
operations have their commands."""

from __future__ import annotations

#: Section -> first word of commands -> what the help says of it.
SECTIONS: dict[str, dict[str, str]] = {
    "Recordings": {
        "init": "Make an empty store.",
        "campaigns": "List the campaigns; describe, show, correct, archive or delete one.",
        "ingest": "Read campaign folders into the store.",
        "runs": "List the recordings of a campaign; show, discard, restore or replace one.",
        "impacts": "List impacts with their figures; show, delete or compare some.",
        "shots": "List the shots of the gun beside the velocity of the model.",
        "show": "Show one impact, and draw its record and pulse.",
        "explore": "Draw any stored quantity against any other, coloured by a third.",
        "views": "List the saved views of `explore`; show, save, rename or delete one.",
        "srs": "Compute the shock response spectrum of any recording.",
        "extract": "Extract the pulses of a campaign again with other settings.",
        "calibrate": "Compute sensitivity and offset of a transducer.",
        "materials": "List the known materials, or add one.",
    },
    "Plans": {
        "plan": "Design a campaign, write its run sheet, predict its runs, and see what is to do.",
        "plans": "List the plans; show or delete one.",
        "simulate": "Fire a plan on the virtual bench.",
    },
    "Models": {
        "dataset": "Freeze pulses for training, and see what a dataset holds.",
        "datasets": "List the datasets; show or delete one.",
        "train": "Train models on a dataset and register them.",
        "models": "List the registered models with their figures; show or delete one.",
        "compare": "Compare models on the same held-out pulses.",
        "promote": "Put a version of a model in use, if it is better.",
    },
    "Predictions": {
        "predict": "Predict velocity, force, acceleration and spectrum of a shot.",
        "validate": "Show how far the predictions for a campaign can be trusted.",
        "tune": "Search the settings that give a prescribed spectrum.",
    },
    "Gap between twin and bench": {
        "diagnose": "Find where the gap lies, what causes it, and how far it shrinks.",
        "diagnoses": "List the diagnoses; show or delete one.",
        "blind-check": "Score the diagnosis on campaigns whose cause is withheld.",
    },
    "Reports and files": {
        "report": "Write a campaign, a diagnosis or a model as one page or PDF.",
        "export": "Write impacts, shots, pulses or series to a file.",
        "search": "Find campaigns, models, notes and all else by words.",
        "query": "Ask the store a question in SQL.",
    },
    "People": {
        "users": "List the people who sign in; add, invite, change or remove one.",
        "notes": "List the notes; write, change or withdraw one.",
        "tags": "List the tags; put one on something, or take it off.",
        "attachments": "List the attached photographs and documents; add, get or remove one.",
        "filters": "List the saved filters of lists; save or delete one.",
        "audit": "List who has changed what.",
    },
    "Operation": {
        "serve": "Start the web application.",
        "work": "Do the long work that was asked for.",
        "jobs": "List the long work; show, stop or delete a job.",
        "db": "Check, copy and upgrade a store; carry campaigns.",
        "home": "List the pictures of the first page; choose and order them.",
        "plugins": "List the readers, effects and models that other packages add.",
        "demo": "Show the product in five chapters.",
    },
}
#: First words of commands, in the order of the help.
COMMANDS = {word: text for words in SECTIONS.values() for word, text in words.items()}

#: Noun -> examples in its help, a line each; its first sentence is that of its section.
NOUNS = {
    "campaigns": "pyroshock campaigns --json\n"
    "pyroshock campaigns show rehearsal\n"
    'pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn" --dry-run',
    "runs": "pyroshock runs list rehearsal\n"
    "pyroshock runs show rehearsal recordings/0001-01.h5\n"
    'pyroshock runs discard rehearsal --run 7 --reason "the plate had come loose" --dry-run',
    "impacts": 'pyroshock impacts --campaign rehearsal --where "peak_force_n>1000"\n'
    "pyroshock impacts --sort -peak_force_n --columns id,tip_material,peak_force_n --csv",
    "materials": "pyroshock materials --columns name,density_kg_m3",
    "plan": "pyroshock plan lhs autumn --runs 12\n"
    "pyroshock plan sheet autumn --out autumn.html\n"
    "pyroshock plan status autumn",
    "plans": "pyroshock plans\npyroshock plans show rehearsal",
    "dataset": "pyroshock dataset build both --from rehearsal,slow-valve\n"
    "pyroshock dataset show both --plot both.png",
    "datasets": "pyroshock datasets\npyroshock datasets show rehearsal-pulses",
    "models": "pyroshock models --dataset rehearsal-pulses\n"
    "pyroshock models gp@1\n"
    "pyroshock models --promotions",
    "diagnoses": "pyroshock diagnoses\npyroshock diagnoses show 1",
    "jobs": "pyroshock jobs --last 50",
    "home": "pyroshock home\npyroshock home arrange --pictures runs-by-plan",
    "views": "pyroshock views\npyroshock views show force-by-velocity",
    "notes": 'pyroshock notes add campaign rehearsal --text "retightened on day 2"\n'
    "pyroshock notes",
    "tags": "pyroshock tags add impact 1 doubtful\npyroshock impacts --where tag=doubtful",
    "attachments": "pyroshock show 1 --plot impact.png\n"
    'pyroshock attachments add impact.png --impact 1 --caption "as recorded"\n'
    "pyroshock attachments",
    "filters": 'pyroshock filters save hard-hits "/impacts?where=peak_force_n>1000"\n'
    "pyroshock filters",
    "users": "pyroshock users add anna --role engineer\npyroshock users",
    "db": "pyroshock db check --fast",
}
#: Noun -> the command that takes a word which is none: `models gp@1` is `models show gp@1`.
OTHERWISE = {"models": "show"}
