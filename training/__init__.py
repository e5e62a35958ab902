"""How a contact model is made, judged and promoted."""
