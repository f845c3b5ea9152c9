// Shows the service's description, which lies beside this page, and sends nothing elsewhere.
SwaggerUIBundle({ url: "openapi.json", dom_id: "#reference", deepLinking: true, validatorUrl: null });
